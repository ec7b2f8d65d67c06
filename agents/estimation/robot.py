"""The recursive estimate of a robot's hidden numbers and of the force at its contact."""

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from agents.arguments import check_kind, check_whole
from agents.environment import EnvIndex, require_entries
from agents.estimation.candidates import ALL, Candidates, Loops
from agents.estimation.force import SATURATED, ForceFilter, Work
from agents.estimation.inputs import check_observation, check_robots, entry_sizes
from agents.estimation.lever import LEAST_LEVER, BentLevers
from agents.estimation.rest import AT_REST, RestingShape
from agents.estimation.shape import observed_commands, observed_ratios
from agents.estimation.tension import Pulls, TensionFilter
from ccr_gym import EXACT, Settings, SpatialSettings

SEEN = 1.2  # standard deviation of a seen command, over that of the angle of a disk
LEAST_SEEN = 1e-3  # of such a standard deviation, where there is no noise [a]
PLAY_ERROR = 0.001  # standard deviation of a seen command that neither noise nor a constant error explain [a]
RIGIDITY_ERROR = 0.01  # standard deviation of the nominal tension, over the tension
LOSS_ERROR = 0.003  # likewise, of the share of friction
TINY = 1e-6  # of a spread, where there is none
SHARE_ERROR = 0.4  # standard deviation of an obstacle's share p of the force, over that of an event, √(p (1 − p))
SHARE_CHANGE = 0.5  # likewise, over its change in a step
MODEL_ERROR = 0.02  # standard deviation of virtual work over the force
LEVER_ERROR = 0.005  # standard deviation of a lever [L/a]
STALL_ERROR = 0.3  # likewise over the force, of a robot that stalls, whose cable does not follow the motor
LARGE = 12.0  # force on the nominal robot, from which on virtual work tells little [EI/L²]
ESTIMATE_ERROR = 0.05  # of the observed estimate over the force, for each EI/L² that bends the robot


class Knowledge(NamedTuple):
    """What is known of k robots, each number with its standard deviation.

    Attributes:
        latency: Delay of what is seen [steps].
        half_backlash: How far cables and motors can be apart [a].
        cables: Where the cables are, ``(k, c)`` [a].
        loss: Share of the tension that friction takes.
        rigidity: Rigidity over its nominal value.
        force: Magnitude of the contact force that is regulated [EI/L²].
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
    A force sensor, where there is one, corrects the force with the delay that was found. Where the observed estimate of
    the force is what is regulated, or all that tells the force, it is taken instead.

    Offset and length of random robots are read from the observation. Where ``randomize`` hides them, the offset is
    found beside the backlash, and the length is taken for the nominal one.

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
        self._settings, self._actuation, self._count = settings, settings.actuation, count
        self._needed, self._others = entry_sizes(settings)
        self._takes_estimate = settings.regulate == "estimate"
        self._pairs = settings.robot.model == "paper" and isinstance(settings, SpatialSettings)
        self._range = settings.cable_limit_mm / settings.scales.travel_mm
        self._tension_span = settings.tension_span
        sensing = settings.sensors or EXACT
        candidates, commands = Candidates.of(sensing), settings.actuation.matrix.shape[1]
        self._candidates = candidates
        self.loops = Loops(count, commands, candidates)
        self._rest, self._levers = RestingShape(settings, count), BentLevers(settings)
        self._slopes = np.zeros((count, commands))  # of the free tension over the motor
        gain = float(np.sqrt((settings.actuation.matrix**2).sum(axis=0).max()))
        self._tension = TensionFilter(count, commands, candidates, sensing, _stall_forces(settings), gain)
        self._force = ForceFilter(count, sensing, int(candidates.latencies[-1]), settings.force_span)
        self._seen_std = max(SEEN * float(np.mean(sensing.angle_noise)), LEAST_SEEN)
        error = max(SEEN * float(np.mean(sensing.angle_error)), LEAST_SEEN)
        self._offset = (self._seen_std / error) ** 2  # readings that the prior of the seen shape's error is worth
        shape = count, len(candidates.latencies), commands, len(candidates.plays)
        self._sums, self._seen = np.zeros((5, *shape)), np.zeros(count)  # of the errors e, places p, e², p², e p
        self._scale, spread = _hidden_scale(settings)
        self._scale_prior = (self._seen_std / max(spread, TINY)) ** 2
        self._unknown = spread
        self._share = np.zeros(count)  # of the force, that the regulated obstacle had in the model

    def reset(self, index: EnvIndex = ALL) -> None:
        """Start new episodes of some robots.

        Raises:
            ValueError: If the index chooses robots that are not there, or one twice.
        """
        check_robots(index, self._count)
        self.loops.reset(index)
        self._rest.reset(index)
        self._tension.reset(index)
        self._force.reset(index)
        for part in (self._seen, self._share, self._slopes):
            part[index] = 0.0
        self._sums[:, index] = 0.0

    def update(self, observation: Mapping[str, np.ndarray], index: EnvIndex = ALL) -> Knowledge:
        """Take in the next observations of some robots, arrays ``(k, ...)``, and return what is known of them.

        Raises:
            ValueError: If they are none of these robots with ``obs_mode="dict"``, or not finite; nothing is taken in.
        """
        check_observation(observation, self._needed, self._others, check_robots(index, self._count))
        motors = self._range * observation["cable"].astype(float)
        touching = np.asarray(observation["contact"].any(axis=1))
        self.loops.update(motors, index)
        self._rest.update(motors, index)
        shape = self._update_shape(observation, index)
        places = self.loops.places[index, 0]
        pulls, free, levers = self._tensions(observation)
        nominal = self._carried(free, motors, places, index)
        self._tension.update(pulls, nominal, self.loops, touching, index)
        weights, delays = _posteriors(shape, self._tension.log_likelihood[index])
        play = weights.sum(axis=2)
        work = self._virtual_work(pulls, nominal, levers, weights, index)
        latency = _moments(self._candidates.latencies, delays)
        rigidity = self._tension.rigidity[index], self._tension.variance[index]
        mean = (weights * rigidity[0]).sum(axis=(1, 2))
        if "lever" in observation:
            work = self._bent(work, mean, observation, pulls, index)
        work, pressing = self._on_target(work, observation, touching, index)
        if self._takes_estimate or not observation.keys() & {"tension", "force_measured"}:
            force, force_std = self._estimated(observation)
        else:
            force, force_std = self._force.update(observation, work, latency[0], pressing, index)
        spread = (weights * (rigidity[1] + (rigidity[0] - mean[:, None, None]) ** 2)).sum(axis=(1, 2))
        half = _moments(self._candidates.plays, play, PLAY_ERROR)
        loss = _moments(self._candidates.losses, weights.sum(axis=1), LOSS_ERROR)
        cables = (play[:, None] * places).sum(axis=2)
        spread = spread + (RIGIDITY_ERROR * mean) ** 2
        return Knowledge(
            latency[0], half[0], cables, loss[0], mean, force, latency[1], half[1], loss[1], np.sqrt(spread), force_std
        )

    def update_one(self, observation: Mapping[str, np.ndarray]) -> Knowledge:
        """Take in the next observation of the only robot, and return what is known of it; see :meth:`update`."""
        require_entries(observation)
        known = self.update({key: np.asarray(value)[None] for key, value in observation.items()})
        return Knowledge(*(entry[0] for entry in known))

    def _update_shape(self, observation: Mapping[str, np.ndarray], index: EnvIndex) -> np.ndarray:
        """Compare the seen shape with each candidate; return log-likelihoods ``(k, L, B)``.

        For a candidate the seen commands are linear in an error of the shape and in the offset of the cables, where
        that is hidden. A robot that stalls does not follow its motors, so its shape is not counted.
        """
        seen = observed_commands(observation, self._settings)
        *_, offset = observed_ratios(observation, self._settings)
        latencies = self._candidates.latencies
        places = self._rest.shown(self.loops.places[index][:, latencies], latencies, index)
        places = places * (self._scale / offset)[:, None, None, None]
        errors = seen[:, None, :, None] - places  # in units of the robot's own offset, as noise is one of angles
        counted = (self._tension.stalls[index] == 0)[:, None, None, None]
        for total, term in zip(self._sums, (errors, places, errors**2, places**2, errors * places), strict=True):
            total[index] += np.where(counted, term, 0.0)
        self._seen[index] += counted[:, 0, 0, 0]
        weight = 1 / (self._seen[index] + self._offset)[:, None, None, None]
        e, p, ee, pp, ep = (total[index] for total in self._sums)
        precision = (pp - p**2 * weight).sum(axis=2) + self._scale_prior
        misfit = (ee - e**2 * weight).sum(axis=2) - (ep - e * p * weight).sum(axis=2) ** 2 / precision
        return np.asarray(-0.5 * misfit / self._seen_std**2 - 0.5 * np.log(precision / self._scale_prior))

    def _tensions(self, observation: Mapping[str, np.ndarray]) -> tuple[Pulls, np.ndarray, np.ndarray]:
        """Return what is measured, free nominal tensions as forces on the commands, and levers, ``(k, c)`` each."""
        zero, sides = np.zeros(observation["cable"].shape), np.ones(observation["cable"].shape)
        if "tension" not in observation:
            return Pulls(zero, sides, np.zeros(len(zero), bool)), zero, zero
        measured, free = (self._tension_span * observation[key].astype(float) for key in ("tension", "free_tension"))
        if self._pairs:  # one displacement and tension of a pair; the sign says which cable is pulled
            sides = np.where(observation["cable"] < 0, -1.0, 1.0)
            measured = sides * measured
        size = np.abs(observation["tension"])
        limited = np.asarray(((size >= SATURATED) & (size <= 1)).any(axis=1))  # those of a log have no limit
        return Pulls(self._actuation.forces(measured), sides, limited), free, observation["lever"].astype(float)

    def _carried(self, free: np.ndarray, motors: np.ndarray, places: np.ndarray, index: EnvIndex) -> np.ndarray:
        """Return free tensions ``(k, c, B)`` where the cables are, from those at the motors; they are linear in both.

        A motor at 0 leaves its cable where the play ends, and tells nothing of the slope there: that before is kept.
        """
        pulled = self._rest.pulled(motors[..., None])[..., 0]
        away = np.abs(pulled) > AT_REST
        slopes = np.where(away, free / np.where(away, pulled, 1.0), self._slopes[index])
        self._slopes[index] = slopes
        return np.asarray(slopes[..., None] * self._rest.pulled(places))

    def _virtual_work(
        self, pulls: Pulls, nominal: np.ndarray, levers: np.ndarray, weights: np.ndarray, index: EnvIndex
    ) -> Work:
        """Return the force that virtual work of the free robot tells.

        What tensions lack across the lever, or against it, no force explains: it is doubt about the lever.
        """
        filtered = self._tension
        factors, levers = filtered.factors(self.loops, index), levers[:, :, None, None]
        robot, doubt = filtered.robot_tensions(pulls, index)
        lacking = robot - filtered.rigidity[index][:, None] * nominal[..., None]
        size = np.maximum((levers**2).sum(axis=1), LEAST_LEVER**2)
        along = (levers * lacking).sum(axis=1) / size
        forces = np.maximum(along, 0.0)
        mean = (weights * forces).sum(axis=(1, 2))
        unexplained = ((lacking - levers * forces[:, None]) ** 2 - (filtered.noise / factors) ** 2).sum(axis=1)
        slow = (levers**2 * doubt).sum(axis=1)
        slow = slow + ((levers * nominal[..., None]).sum(axis=1)) ** 2 * filtered.variance[index]
        slow = slow / size**2 + (forces - mean[:, None, None]) ** 2 + np.maximum(unexplained, 0.0) / size
        white = ((levers / factors) ** 2).sum(axis=1) * filtered.noise**2 / size**2
        return Work(mean, (weights * slow).sum(axis=(1, 2)), (weights * white).sum(axis=(1, 2)))

    def _bent(
        self,
        work: Work,
        rigidity: np.ndarray,
        observation: Mapping[str, np.ndarray],
        pulls: Pulls,
        index: EnvIndex,
    ) -> Work:
        """Return the force for the levers of the robots that it bends."""
        own, length, offset = observed_ratios(observation, self._settings)
        unit = rigidity * own / length**2
        change = self._levers.change(work.force / unit, observation, offset)
        lever = np.maximum(np.linalg.norm(observation["lever"], axis=1), LEAST_LEVER)
        force, large = work.force / change, LARGE * self._actuation.sections**2
        error = np.hypot(MODEL_ERROR, LEVER_ERROR / lever) + self._unknown * np.abs(1 - 1 / change)
        error = np.minimum(error + (force / unit / large) ** 4, 1.0) + STALL_ERROR * (self._tension.stalls[index] > 0)
        error = error + pulls.limited
        return Work(force, work.slow / change**2 + (error * force) ** 2, work.white / change**2)

    def _on_target(
        self, work: Work, observation: Mapping[str, np.ndarray], touching: np.ndarray, index: EnvIndex
    ) -> tuple[Work, np.ndarray]:
        """Return the force on the regulated obstacle, and whether that touches, ``(k,)``.

        The model says how several obstacles share the force, where the cables are as the encoders read them.
        """
        if "share" not in observation:
            return work, touching
        share = observation["share"][:, 0].astype(float)
        error = SHARE_ERROR**2 * share * (1 - share) + SHARE_CHANGE**2 * (share - self._share[index]) ** 2
        self._share[index] = share
        slow = share**2 * work.slow + error * work.force**2
        return Work(share * work.force, slow, share**2 * work.white), touching & (share > 0)

    def _estimated(self, observation: Mapping[str, np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
        """Return the magnitude of the observed estimate of the force and its standard deviation, ``(k,)`` each."""
        estimate = observation["force_est"].astype(float)
        force = np.linalg.norm(self._settings.force_span * estimate, axis=1)
        limited = (np.abs(estimate) >= SATURATED).any(axis=1)
        own, length, _ = observed_ratios(observation, self._settings)
        bent = force * length**2 / own / self._actuation.sections**2
        error = 0.0 if self._takes_estimate else np.minimum(MODEL_ERROR + ESTIMATE_ERROR * bent, 1.0)
        return force, np.where(limited, 1.0, error) * force


def _hidden_scale(settings: Settings | SpatialSettings) -> tuple[float, float]:
    """Return mean and standard deviation of the nominal offset over that of a robot, of which nothing else tells."""
    robots = settings.randomize
    if robots is None or robots.observed:
        return 1.0, 0.0
    low, high = np.log(robots.offset)
    ratios = np.exp(-np.linspace(low, high, 33))
    return float(ratios.mean()), float(ratios.std())


def _stall_forces(settings: Settings | SpatialSettings) -> np.ndarray:
    """Return the forces on the commands at which the nominal robot stalls, out and in, ``(2, c)`` [EI/(aL)].

    Cables nearer to the backbone than the offset of the robot bend it by less. Where several share a command, a single
    one may carry all of it.
    """
    matrix, limit = settings.actuation.matrix, settings.robot.max_tension / settings.scales.tension_n
    shares = np.array([np.maximum(side * matrix, 0.0).sum(axis=0) for side in (-1, 1)])
    return limit * np.where(shares > 0, np.minimum(shares, 1.0), 1.0)


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
