"""By how much a disparity may be wrong: its standard deviation, an interval, and a probability."""
