"""Calibrated cameras made a light field: their files, and the views that parallel cameras in one plane would have."""
