"""Learners, classical controllers and the command line on top of ccr_gym."""
