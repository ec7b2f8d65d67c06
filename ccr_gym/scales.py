"""Scales of the observation, and the steps at which a moving set-point is previewed."""

FORCE_SCALE_N = 0.5  # force that is observed as 1
RADIUS_SCALE_MM = 20.0  # obstacle radius that is observed as 1
AHEAD = (2, 4, 8)  # steps ahead at which a moving set-point is observed
