"""What a session shows after each step: numbers and arrays, in the units of the page.

The page is always in space, with z up and the robot's length as its unit. The plane of a planar robot is x and z.
"""

from dataclasses import dataclass, field

import numpy as np

from solver import Obstacle


@dataclass(frozen=True, slots=True, eq=False)
class Shape:
    """The robot, in units of its length.

    Attributes:
        nodes: Backbone points, ``(n+1, 3)``.
        disks: Orientation of each disk as a quaternion w, x, y, z, whose third axis is the normal, ``(n+1, 4)``.
        cables: Ends of the pieces of all cables, ``(s, 2, 3)``.
        taut: Whether the cable of each piece carries tension, ``(s,)`` bool.
    """

    nodes: np.ndarray
    disks: np.ndarray
    cables: np.ndarray
    taut: np.ndarray


@dataclass(frozen=True, slots=True, eq=False)
class Contacts:
    """Points in contact and the force there.

    Attributes:
        points: The points, ``(k, 3)`` [L].
        levels: Their multipliers as forces, over the force that fills the scale, ``(k,)``.
        touched: Indices of the obstacles that are touched.
        arrow_true: Tail and head of the true force on the obstacles, ``(2, 3)`` [L]; both the same
            without contact.
        arrow_est: The same of the estimate.
    """

    points: np.ndarray
    levels: np.ndarray
    touched: frozenset[int]
    arrow_true: np.ndarray
    arrow_est: np.ndarray


@dataclass(frozen=True, slots=True, eq=False)
class Numbers:
    """What the page prints and plots.

    Attributes:
        step: Steps since the scene began.
        status: How the last step ended.
        desired: Set-point [N].
        true: True contact force [N].
        estimate: Estimated contact force [N].
        tensions: Tension of each cable [N].
        residual: Largest of ``equilibrium.residuals()``, as last computed.
        reward: Reward of the step.
        actuated_mm: Actuated coordinates [mm].
        message: What the user should know, or an empty text.
    """

    step: int
    status: str
    desired: float
    true: float
    estimate: float
    tensions: tuple[float, ...]
    residual: float
    reward: float
    actuated_mm: tuple[float, ...]
    message: str


@dataclass(frozen=True, slots=True, eq=False)
class Frame:
    """What a session shows after a step.

    Attributes:
        shape: The robot.
        obstacles: The obstacles where they are now [mm].
        resting: The same without the displacement of their springs [mm].
        contacts: The contacts.
        numbers: The numbers.
    """

    shape: Shape
    obstacles: tuple[Obstacle, ...]
    resting: tuple[Obstacle, ...]
    contacts: Contacts
    numbers: Numbers = field(repr=False)
