"""What smooths or completes a disparity map."""
