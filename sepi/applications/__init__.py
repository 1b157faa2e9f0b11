"""What one makes of finished maps."""
