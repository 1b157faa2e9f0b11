"""Estimates from the views alone: disparity range, order of the views, sign of the disparity."""
