"""Random walks of the solver among ordinary and adversarial obstacles, checked independently of the kernel.

``scenes`` samples robots and scenes, ``walks`` samples commands, and ``checks`` states what must be true of every step,
by distances in numpy (``shapes``) and by whether the robot swept through an obstacle (``cores``). ``episodes`` combines
them, ``report`` sums up the findings, and ``cases`` shrinks and replays them. ``scale`` scales robots and scenes.
``python -m soak --help`` runs episodes in many processes.
"""
