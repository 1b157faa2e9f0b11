"""The command ``sepi``."""
