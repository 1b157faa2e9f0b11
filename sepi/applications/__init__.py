"""Applications of finished maps."""
