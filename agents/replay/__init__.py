"""Contact forces from the log of a real robot: its files, the replay through solver and estimator, and the results."""
