"""Pictures of the robot, its obstacles and its contact force."""

from ccr_gym.rendering.frame import Frame
from ccr_gym.rendering.grid import tile
from ccr_gym.rendering.renderer import Renderer

__all__ = ["Frame", "Renderer", "tile"]
