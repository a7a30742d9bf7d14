"""Input of a run that is going on: bytes with their times, lag, audio devices."""
