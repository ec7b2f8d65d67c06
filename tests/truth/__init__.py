"""Independent truth for the rod: written from its equations, sharing nothing with the package's solver.

Only :mod:`truth.robots` touches the package: it turns descriptions of robots and scenes into the package's own.
"""
