"""Light fields from calibrated cameras: their files, and the views of parallel cameras in one plane."""
