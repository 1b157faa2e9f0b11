"""What compares views: costs of candidate disparities, and refinement on the residuals."""
