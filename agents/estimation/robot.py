"""The recursive estimate of a robot's hidden numbers and of the force at its contact."""

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from agents.arguments import check_kind, check_whole
from agents.environment import EnvIndex
from agents.estimation.candidates import ALL, Candidates, Loops
from agents.estimation.force import ForceFilter
from agents.estimation.shape import observed_commands, observed_sizes
from agents.estimation.tension import TensionFilter
from ccr_gym import EXACT, Settings, SpatialSettings

SEEN = 1.2  # standard deviation of a seen command, over that of the angle of a disk
LEAST_SEEN = 1e-3  # of such a standard deviation, where there is no noise [a]
PLAY_ERROR = 0.001  # standard deviation of a seen command that neither noise nor a constant error explain [a]
RIGIDITY_ERROR = 0.01  # standard deviation of the nominal tension, over the tension
LOSS_ERROR = 0.003  # likewise, of the share of friction
LEAST_LEVER = 0.02  # of a contact's motion against its force; below, a pull hardly presses on it [L/a]
SHARE_ERROR = 0.4  # standard deviation of an obstacle's share p of the force, over that of an event, √(p (1 − p))
SHARE_CHANGE = 0.5  # likewise, over its change in a step
MODEL_ERROR = 0.1  # standard deviation of virtual work over the force: other points move than those of a free robot
LARGE = 12.0  # force on the nominal robot, whose square the share is over that virtual work falls short [EI/L²]
SHORT_ERROR = 0.5  # standard deviation of what it falls short by, over that
LARGEST = 8.0  # such a force up to which this was measured [EI/L²]
LEAST_RIGIDITY = 0.1  # rigidity ratio, below those that are sampled


class Knowledge(NamedTuple):
    """What is known of k robots, each number with its standard deviation.

    Attributes:
        latency: Delay of what is seen [steps].
        half_backlash: How far cables and motors can be apart [a].
        cables: Where the cables are, ``(k, c)`` [a].
        loss: Share of the tension that friction takes.
        rigidity: Rigidity over its nominal value.
        force: Magnitude of the contact force [EI/L²].
        latency_std, half_backlash_std, loss_std, rigidity_std, force_std: Their standard deviations, ``(k,)``.
    """

    latency: np.ndarray
    half_backlash: np.ndarray
    cables: np.ndarray
    loss: np.ndarray
    rigidity: np.ndarray
    force: np.ndarray
    latency_std: np.ndarray
    half_backlash_std: np.ndarray
    loss_std: np.ndarray
    rigidity_std: np.ndarray
    force_std: np.ndarray


class RobotEstimator:
    """Estimates what is hidden of many robots from their observations and the known ranges of the imperfections.

    Backlash and latency come from the seen shape, rigidity, friction and zeros of the sensors from tensions, and the
    contact force from virtual work: what the cable pulls more than the free robot needs, over the lever of the contact.
    A force sensor, where there is one, corrects the force with the delay that was found.

    Offset and length of random robots are read from the observation; where ``randomize`` hides them, the robots are
    taken to be the nominal one.

    Args:
        settings: Settings of the environments.
        count: Number N of robots.

    Raises:
        ValueError: If the count is no positive whole number.
        TypeError: If ``settings`` are none of an environment.
    """

    def __init__(self, settings: Settings | SpatialSettings, count: int) -> None:
        check_kind("settings", settings, (Settings, SpatialSettings), "take those of an environment")
        check_whole("count", count, 1, 2**31 - 1)
        self._settings, self._actuation = settings, settings.actuation
        self._range = settings.cable_limit_mm / settings.scales.travel_mm
        self._tension_span = settings.tension_span
        sensing = settings.sensors or EXACT
        candidates, commands = Candidates.of(sensing), settings.actuation.matrix.shape[1]
        self._candidates = candidates
        limit = settings.robot.max_tension / settings.scales.tension_n
        self.loops = Loops(count, commands, candidates)
        self._tension = TensionFilter(count, commands, candidates, sensing, limit)
        self._force = ForceFilter(count, sensing, int(candidates.latencies[-1]), settings.force_span)
        self._seen_std = max(SEEN * float(np.mean(sensing.angle_noise)), LEAST_SEEN)
        error = max(SEEN * float(np.mean(sensing.angle_error)), LEAST_SEEN)
        self._offset = (self._seen_std / error) ** 2  # readings that the prior of the seen shape's error is worth
        shape = count, len(candidates.latencies), commands, len(candidates.plays)
        self._errors, self._squares, self._seen = np.zeros(shape), np.zeros(shape), np.zeros(count)
        self._share = np.zeros(count)  # of the force, that the regulated obstacle had in the model

    def reset(self, index: EnvIndex = ALL) -> None:
        """Start new episodes of some robots."""
        self.loops.reset(index)
        self._tension.reset(index)
        self._force.reset(index)
        for part in (self._errors, self._squares, self._seen, self._share):
            part[index] = 0.0

    def update(self, observation: Mapping[str, np.ndarray], index: EnvIndex = ALL) -> Knowledge:
        """Take in the next observations of some robots, arrays ``(k, ...)``, and return what is known of them."""
        motors = self._range * observation["cable"].astype(float)
        touching = np.asarray(observation["contact"].any(axis=1))
        self.loops.update(motors, index)
        shape = self._update_shape(observation, index)
        places = self.loops.places[index, 0]
        tensions, free, levers = self._tensions(observation)
        nominal = _carried(free, motors, places)
        self._tension.update(tensions, nominal, self.loops, touching, index)
        weights, delays = _posteriors(shape, self._tension.log_likelihood[index])
        play = weights.sum(axis=2)
        force, variance = self._virtual_work(tensions, nominal, levers, weights, index)
        latency = _moments(self._candidates.latencies, delays)
        force, variance, pressing = self._on_target(force, variance, observation, touching, index)
        force, force_std = self._force.update(observation, force, variance, latency[0], pressing, index)
        rigidity = self._tension.rigidity[index], self._tension.variance[index]
        mean = (weights * rigidity[0]).sum(axis=(1, 2))
        spread = (weights * (rigidity[1] + (rigidity[0] - mean[:, None, None]) ** 2)).sum(axis=(1, 2))
        half = _moments(self._candidates.plays, play, PLAY_ERROR)
        loss = _moments(self._candidates.losses, weights.sum(axis=1), LOSS_ERROR)
        cables = (play[:, None] * places).sum(axis=2)
        spread = spread + (RIGIDITY_ERROR * mean) ** 2
        return Knowledge(
            latency[0], half[0], cables, loss[0], mean, force, latency[1], half[1], loss[1], np.sqrt(spread), force_std
        )

    def update_one(self, observation: Mapping[str, np.ndarray]) -> Knowledge:
        """Take in the next observation of the only robot, and return what is known of it."""
        known = self.update({key: value[None] for key, value in observation.items()})
        return Knowledge(*(entry[0] for entry in known))

    def _update_shape(self, observation: Mapping[str, np.ndarray], index: EnvIndex) -> np.ndarray:
        """Compare the seen shape with each candidate; return log-likelihoods ``(k, L, B)``."""
        seen, (_, offset) = observed_commands(observation, self._settings), observed_sizes(observation, self._settings)
        places = self.loops.places[index][:, self._candidates.latencies] / offset[:, None, None, None]
        errors = seen[:, None, :, None] - places  # in units of the robot's own offset, as noise is one of angles
        self._errors[index] += errors
        self._squares[index] += errors**2
        self._seen[index] += 1
        weight = 1 / (self._seen[index] + self._offset)[:, None, None, None]
        misfit = (self._squares[index] - self._errors[index] ** 2 * weight).sum(axis=2)
        return np.asarray(-0.5 * misfit / self._seen_std**2)

    def _tensions(self, observation: Mapping[str, np.ndarray]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return measured and nominal free tensions as forces on the commands, and levers, ``(k, c)`` each."""
        if "tension" not in observation:
            zero = np.zeros(observation["cable"].shape)
            return zero, zero, zero
        measured, free = (self._tension_span * observation[key].astype(float) for key in ("tension", "free_tension"))
        return self._actuation.forces(measured), free, observation["lever"].astype(float)

    def _virtual_work(
        self, tensions: np.ndarray, nominal: np.ndarray, levers: np.ndarray, weights: np.ndarray, index: EnvIndex
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return mean and variance of the force that virtual work tells, ``(k,)``."""
        filtered = self._tension
        factors, levers = filtered.factors(self.loops, index), levers[:, :, None, None]
        robot, doubt = filtered.robot_tensions(tensions, index)
        lacking = robot - filtered.rigidity[index][:, None] * nominal[..., None]
        size = np.maximum((levers**2).sum(axis=1), LEAST_LEVER**2)
        forces = np.maximum((levers * lacking).sum(axis=1) / size, 0.0)
        short = forces * self._shortfall(forces, filtered.rigidity[index])
        forces = forces + short
        inner = ((levers / factors) ** 2).sum(axis=1) * filtered.noise**2
        inner = inner + (levers**2 * doubt).sum(axis=1)
        inner = inner + ((levers * nominal[..., None]).sum(axis=1)) ** 2 * filtered.variance[index]
        mean = (weights * forces).sum(axis=(1, 2))
        spread = inner / size**2 + (forces - mean[:, None, None]) ** 2
        model = (MODEL_ERROR * mean) ** 2 + (SHORT_ERROR * (weights * short).sum(axis=(1, 2))) ** 2
        return mean, (weights * spread).sum(axis=(1, 2)) + model

    def _shortfall(self, forces: np.ndarray, rigidity: np.ndarray) -> np.ndarray:
        """Return by which share virtual work falls short of forces.

        It counts the motion of a free robot, and a force bends the robot away from that, by the square of the force.
        """
        nominal = forces / np.maximum(rigidity, LEAST_RIGIDITY) / self._actuation.sections**2
        return np.asarray((np.minimum(nominal, LARGEST) / LARGE) ** 2)

    def _on_target(
        self,
        force: np.ndarray,
        variance: np.ndarray,
        observation: Mapping[str, np.ndarray],
        touching: np.ndarray,
        index: EnvIndex,
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return mean and variance of the force on the regulated obstacle, and whether that touches, ``(k,)`` each.

        The model says how several obstacles share the force, where the cables are as the encoders read them.
        """
        if "share" not in observation:
            return force, variance, touching
        share = observation["share"][:, 0].astype(float)
        error = SHARE_ERROR**2 * share * (1 - share) + SHARE_CHANGE**2 * (share - self._share[index]) ** 2
        self._share[index] = share
        return share * force, share**2 * variance + error * force**2, touching & (share > 0)


def _carried(free: np.ndarray, motors: np.ndarray, places: np.ndarray) -> np.ndarray:
    """Return free tensions ``(k, c, B)`` where the cables are, from those at the motors; they are linear in both."""
    near = np.abs(motors) < 1e-6
    return np.asarray(free[..., None] * (places / np.where(near, 1.0, motors)[..., None]))


def _posteriors(shape: np.ndarray, tension: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return probabilities of backlash with friction, ``(k, B, E)``, and of latencies, ``(k, L)``."""
    joint = shape[:, :, :, None] + tension[:, None]
    joint = np.exp(joint - joint.max(axis=(1, 2, 3), keepdims=True))
    joint = joint / joint.sum(axis=(1, 2, 3), keepdims=True)
    return joint.sum(axis=1), joint.sum(axis=(2, 3))


def _moments(values: np.ndarray, weights: np.ndarray, least: float = 0.0) -> tuple[np.ndarray, np.ndarray]:
    """Return means and standard deviations of candidates with these probabilities, ``(k,)``.

    Between candidates the truth is taken to be spread evenly, and the models to err by at least so much.
    """
    mean = (weights * values).sum(axis=1)
    step = values[1] - values[0] if len(values) > 1 else 0.0
    variance = (weights * values**2).sum(axis=1) - mean**2 + step**2 / 12
    least = least if len(values) > 1 else 0.0
    return mean, np.sqrt(np.maximum(variance, 0.0) + least**2)
