"""Random walks of the solver among ordinary and adversarial obstacles, and checks that share nothing with the kernel.

``scale`` scales robots and scenes; ``shapes`` measures distances to obstacles in numpy; ``cores`` tells whether the
robot swept through one; ``scenes`` samples what an episode is played in, ``episodes`` plays and checks it, ``report``
adds up what was found. ``python -m soak --help`` runs them in many processes.
"""
