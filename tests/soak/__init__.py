"""Random walks of the solver among ordinary and adversarial obstacles, and checks that share nothing with the kernel.

``scenes`` samples what an episode is played in, ``walks`` how the cables are pulled, ``checks`` tells what must hold of
every step, with ``shapes`` (distances in numpy) and ``cores`` (whether the robot swept through an obstacle);
``episodes`` puts them together, ``report`` adds up what was found, and ``cases`` makes it small and plays it again.
``scale`` scales robots and scenes. ``python -m soak --help`` runs them in many processes.
"""
