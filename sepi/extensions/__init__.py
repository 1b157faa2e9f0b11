"""What the core does without: each folder is an extension, found by its entry point in pyproject.toml."""
