"""The method at work on single pixels."""
