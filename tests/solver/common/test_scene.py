"""A scene holds obstacles and nothing else."""

import pytest

from solver import (
    Circle,
    Scene,
)


def test_scene():
    for obstacles in (None, 3, Circle(center=(40, 100), radius=10)):
        with pytest.raises(TypeError, match=r"obstacles is .*; give a list of obstacles"):
            Scene(obstacles)
    with pytest.raises(TypeError, match=r"an entry of obstacles is .*; give a Circle, HalfPlane"):
        Scene([(40.0, 100.0, 10.0)])
