"""Learners, classical controllers and the command line on top of ccr_gym."""

PART_OF = "ccr-gym"  # tells this package from others of its name
