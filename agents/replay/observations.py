"""The rows of a log as an environment would have observed them."""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from agents.errors import UserError
from agents.estimation.robot import SEEN
from agents.replay.commands import actuation_of
from agents.replay.log import Log
from agents.replay.model import AnyEquilibrium
from agents.replay.robots import AnyRobot
from agents.replay.sensing import Instruments
from ccr_gym import EXACT, ContactEnv, PushObstacleEnv, Settings, SpatialPushEnv, SpatialSettings
from solver import Robot, Scene
from solver.spatial import SpatialEquilibrium

UNSEEN = 1.0  # noise of a shape that nobody measured [rad]
SET_POINT = 1.0  # of the environment, whose reward nobody reads [EI/L²]
PLANAR_TASK = {"radius": (0.45, 0.45), "x": (0.9, 0.9)}  # whose own obstacles suit robots of few segments, too
SPATIAL_TASK = {"radius": (0.45, 0.45), "distance": (0.9, 0.9)}
AnySettings = Settings | SpatialSettings


def settings_of(robot: AnyRobot, instruments: Instruments, deviation: float | None) -> AnySettings:
    """Return the settings of an environment whose sensing is that of the robot.

    Args:
        robot: The robot.
        instruments: Imperfections of its motors and sensors.
        deviation: As of :class:`agents.replay.seen.Seen`.
    """
    noise = error = UNSEEN
    if deviation is not None:
        angle = deviation / robot.offset_mm / SEEN
        noise, error = (
            min(angle * size, UNSEEN) for size in (instruments.position_noise_mm, instruments.position_error_mm)
        )
    latency = instruments.sensing.latency if deviation is not None else (0, 0)
    sensing = replace(instruments.sensing, angle_noise=(noise, noise), angle_error=(error, error), latency=latency)
    return _settings(robot, sensing=sensing, force_sensor=False)


def _settings(robot: AnyRobot, **others: Any) -> AnySettings:
    kind = Settings if isinstance(robot, Robot) else SpatialSettings
    return kind(robot=robot, **_ranges(robot), **others)  # type: ignore[arg-type]


def _ranges(robot: AnyRobot) -> dict[str, Any]:
    """Return the settings by which one step may command anything that the robot's cables can do."""
    limit = robot.cable_limit_mm / actuation_of(robot).sections
    return {"cable_limit_mm": limit, "max_increment_mm": limit}


def check_commands(commands_mm: np.ndarray, log: Log, robot: AnyRobot, name: str) -> None:
    """Check that commands of several sections are within what an environment can command.

    Raises:
        UserError: Naming the line, the section and the bound.
    """
    limit = _ranges(robot)["cable_limit_mm"]
    for row, command in np.argwhere(np.abs(commands_mm) > limit * (1 + 1e-9)):
        raise UserError(
            f"{name}, line {log.rows[row]}: the cables bend a section by {commands_mm[row, command]:.4g} mm of cable; "
            f"at most {limit:.4g} are allowed, max_cable_mm of the robot over its sections: raise max_cable_mm"
        )


def observations(
    log: Log, settings: AnySettings, scene: Scene, commands_mm: np.ndarray, shapes: Sequence[AnyEquilibrium]
) -> Iterator[Mapping[str, np.ndarray]]:
    """Yield the observations of the rows, as of an environment with ``obs_mode="dict"``.

    An environment without imperfections is led along the encoders; it tells contacts, levers and tensions of the free
    robot. Tensions are those of the log.

    Args:
        log: The log.
        settings: Settings of :func:`settings_of`.
        scene: The obstacles.
        commands_mm: Commands that the encoders read, ``(K, commands)`` [mm].
        shapes: Shapes that were seen.
    """
    env, now = _environment(settings), np.zeros(commands_mm.shape[1])
    tension = settings.tension_span * settings.scales.tension_n
    env.reset(seed=0, options={"scene": scene, "desired_force": SET_POINT * settings.scales.force_n})
    for row, command in enumerate(commands_mm):
        observation = _led(env, now, command, settings.max_increment_mm)
        measured = {"cable": command / settings.cable_limit_mm, "tension": log.tensions_n[row] / tension}
        yield {**observation, **measured, **_shape(shapes[row], settings)}
        now = command
    env.close()


def _environment(settings: AnySettings) -> ContactEnv:
    """Return an environment of the nominal robot, without imperfections."""
    planar = isinstance(settings, Settings)
    kind, task = (PushObstacleEnv, PLANAR_TASK) if planar else (SpatialPushEnv, SPATIAL_TASK)
    return kind(
        task=task, robot=settings.robot, obs_mode="dict", sensing=EXACT, force_sensor=False, **_ranges(settings.robot)
    )


def _led(env: ContactEnv, now_mm: np.ndarray, wanted_mm: np.ndarray, most_mm: float) -> dict[str, np.ndarray]:
    """Return the observation after the environment is led from commands to others."""
    action = (wanted_mm - now_mm) / most_mm
    parts = max(1, math.ceil(np.abs(action).max() - 1e-9))
    for _ in range(parts):
        observation, *_ = env.step(action / parts)
    assert isinstance(observation, dict)
    return observation


def _shape(equilibrium: AnyEquilibrium, settings: AnySettings) -> dict[str, np.ndarray]:
    """Return the observed entries of a shape."""
    if isinstance(equilibrium, SpatialEquilibrium):
        axes = np.swapaxes(equilibrium.frames[:, :, [0, 2]], 1, 2)
        return {"nodes": equilibrium.nodes.ravel() / settings.reach_mm, "frames": axes.ravel()}
    return {"nodes": (equilibrium.nodes / [settings.reach_mm, settings.reach_mm, np.pi]).ravel()}
