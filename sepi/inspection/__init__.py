"""What the views tell of the light field itself: disparity range, order of the views, sign of the disparity."""
