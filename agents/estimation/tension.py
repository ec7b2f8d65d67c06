"""Rigidity, friction and zero of the tension sensors, from tensions before contact and around reversals.

For each candidate of backlash and friction the tension of a free robot is linear in what is left: ``y = z + r x g``,
with the rigidity ratio r, a zero z for each command, the tension x of the nominal free robot and ``g = 1/(1 − η)``
while the cable moves in, ``1 − η`` while it moves out. In contact the tension in the robot is a smooth function of its
cable, the same in both directions; what breaks that counts against a candidate.
"""

from typing import NamedTuple

import numpy as np

from agents.environment import EnvIndex
from agents.estimation.candidates import Candidates, Loops
from ccr_gym import Sensing

SMOOTHNESS = 0.9  # weight of the past in the lines through tensions in contact, per step
SLIP = 0.02  # standard deviation of a tension in contact from such a line, over the tension
COUNTED = 0.5  # share of the evidence before contact that counts, as the nominal tension is only nearly known
TRUST = 0.1  # share of the evidence in contact that counts, as errors of neighbouring steps are alike
STALLED = 0.9  # tension over its limit, from which on a robot may have stalled
STALL_STEPS = 8  # after a stall, in which a late shape and a motor that ran ahead of its cable tell nothing
LEAST = 1e-3  # of standard deviations, for candidates without noise [EI/(aL)]


class Pulls(NamedTuple):
    """Tensions that are measured of k robots.

    Attributes:
        forces: What the motors see as forces on the commands, ``(k, c)`` [EI/(aL)].
        sides: −1 where the other cable of a pair is pulled, and the zero counts against it, otherwise 1, ``(k, c)``.
        limited: Whether a load cell is at its limit, ``(k,)`` bool: then the tension is at least what it reads.
    """

    forces: np.ndarray
    sides: np.ndarray
    limited: np.ndarray


class TensionFilter:
    """Beliefs about rigidity, friction and zeros of many robots.

    Args:
        count: Number N of robots.
        commands: Number c of commands of a robot.
        candidates: The candidates.
        sensing: Ranges of the imperfections.
        limits: Forces on the commands at which the nominal robot stalls, out and in, ``(2, c)`` [EI/(aL)].
        gain: Largest root of the sum of squares of the cables' shares in a command, by which their errors add up.

    Attributes:
        log_likelihood: Of the candidates of backlash and friction, ``(N, B, E)``.
        rigidity: Mean of the rigidity ratio for each, ``(N, B, E)``.
        variance: Its variance, ``(N, B, E)``.
        zeros: Means of the zeros, ``(N, c, B, E)`` [EI/(aL)].
        inward: Probabilities that the cables last moved in, ``(N, c, B, E)``.
        stalls: Steps until what a stall has left of the cables' places is forgotten, ``(N,)``.
    """

    def __init__(
        self, count: int, commands: int, candidates: Candidates, sensing: Sensing, limits: np.ndarray, gain: float
    ) -> None:
        self._limits, self._kept = limits[..., None, None], 1 - candidates.losses
        self.noise = max(gain * sensing.tension_noise[1], LEAST)
        self._least, self._most = sensing.rigidity_ratio
        self._usual, spread = (self._least + self._most) / 2, max((self._most - self._least) / np.sqrt(12), LEAST)
        self._ridge = (self.noise / spread) ** 2  # what the prior of the rigidity ratio weighs
        zero = max(gain * sensing.tension_zero[1] / np.sqrt(3), LEAST)
        self._prior = (self.noise / zero) ** 2  # readings that the prior of a zero is worth
        shape = count, commands, len(candidates.plays), len(candidates.losses)
        self._sums = np.zeros((5, *shape))  # of 1, x, y, x², x y
        self._squares = np.zeros(shape[:2])  # of y²
        self._lines = np.zeros((5, *shape))  # decaying sums in contact of 1, l, t, l², l t
        self._broken = np.zeros((count, *shape[2:]))  # log-likelihood from contact
        self._onset = np.full(count, np.inf)  # size of the commands at the first contact [a]
        self._margin = 2 * float(candidates.plays[-1])
        self.rigidity = np.full((count, *shape[2:]), self._usual)
        self.variance = np.full(self.rigidity.shape, self.noise**2 / self._ridge)
        self.zeros, self.inward = np.zeros(shape), np.ones(shape)
        self.log_likelihood = np.zeros((count, *shape[2:]))
        self.stalls = np.zeros(count, int)

    def reset(self, index: EnvIndex) -> None:
        """Start new episodes of some robots."""
        self._sums[:, index] = self._lines[:, index] = 0.0
        for part in (self._squares, self._broken, self.zeros, self.log_likelihood, self.stalls):
            part[index] = 0.0
        self.inward[index] = 1.0
        self._onset[index] = np.inf
        self.rigidity[index], self.variance[index] = self._usual, self.noise**2 / self._ridge

    def update(self, pulls: Pulls, nominal: np.ndarray, loops: Loops, touching: np.ndarray, index: EnvIndex) -> None:
        """Take in the tensions of the next step of some robots.

        Args:
            pulls: What is measured.
            nominal: Tension of the nominal free robot where its cables are, ``(k, c, B)`` [EI/(aL)].
            loops: Where the cables are.
            touching: Whether the model says that something touches, ``(k,)`` bool.
            index: The robots.
        """
        places, factors = loops.places[index, 0], self.factors(loops, index)
        size = np.abs(places).max(axis=(1, 2))
        self._onset[index] = np.where(touching, np.minimum(self._onset[index], size), self._onset[index])
        free = ~touching & ~pulls.limited & (size < self._onset[index] - self._margin)
        self._update_free(pulls, nominal, factors, free, index)
        self._update_contact(pulls, places, loops, touching, index)
        self.log_likelihood[index] = self._evidence(index) + self._broken[index]

    def factors(self, loops: Loops, index: EnvIndex) -> np.ndarray:
        """Return the tension at the motor over that in the robot, ``(k, c, B, E)``."""
        return np.asarray(np.where(loops.moved_in[index][..., None], 1 / self._kept, self._kept))

    def _update_free(
        self, pulls: Pulls, nominal: np.ndarray, factors: np.ndarray, wanted: np.ndarray, index: EnvIndex
    ) -> None:
        x, y = (pulls.sides[..., None] * nominal)[..., None] * factors, (pulls.sides * pulls.forces)[..., None, None]
        counted = wanted[:, None, None, None]
        terms = (np.ones_like(x), x, np.broadcast_to(y, x.shape), x * x, x * y)
        for total, term in zip(self._sums, terms, strict=True):
            total[index] += np.where(counted, term, 0.0)
        self._squares[index] += np.where(wanted[:, None], pulls.forces**2, 0.0)

    def _evidence(self, index: EnvIndex) -> np.ndarray:
        """Solve for rigidity and zeros of each candidate, and return its log-likelihood, ``(k, B, E)``.

        The rigidity is the likeliest one in its range, so that noise never makes it negative.
        """
        count, sx, sy, sxx, sxy = (total[index] for total in self._sums)
        weight = 1 / (count + self._prior)  # a zero is taken out of each command
        cxx, cxy = (sxx - sx * sx * weight).sum(axis=1), (sxy - sx * sy * weight).sum(axis=1)
        cyy = (self._squares[index][..., None, None] - sy * sy * weight).sum(axis=1)
        precision, product = cxx + self._ridge, cxy + self._ridge * self._usual
        mean = np.clip(product / precision, self._least, self._most)
        self.rigidity[index], self.variance[index] = mean, self.noise**2 / precision
        self.zeros[index] = (sy - mean[:, None] * sx) * weight
        misfit = cyy + self._ridge * self._usual**2 + mean * (mean * precision - 2 * product)
        return np.asarray(COUNTED * (-0.5 * misfit / self.noise**2 - 0.5 * np.log(precision)))

    def robot_tensions(self, pulls: Pulls, index: EnvIndex) -> tuple[np.ndarray, np.ndarray]:
        """Return mean and variance of the tensions in the robots, as far as directions decide, ``(k, c, B, E)``."""
        inside, outside = self._both_ways(pulls, index)
        inward = self.inward[index]
        return _mixed(inward, inside, outside), inward * (1 - inward) * (inside - outside) ** 2

    def _both_ways(self, pulls: Pulls, index: EnvIndex) -> np.ndarray:
        """Return the tensions in the robots if the cables last moved in, and if they moved out, ``(2, k, c, B, E)``."""
        motor = pulls.forces[..., None, None] - pulls.sides[..., None, None] * self.zeros[index]
        return np.stack([motor * self._kept, motor / self._kept])

    def _expected(self, both: np.ndarray, inward: np.ndarray, index: EnvIndex) -> np.ndarray:
        """Return the probabilities that cables last moved in before their tensions are seen, ``(k, c, B, E)``.

        A robot that stalls does not follow its motor, and what it touches may have moved its cable either way.
        """
        return np.where(self._stalled(both[1], index), 0.5, inward)

    def _stalled(self, robot: np.ndarray, index: EnvIndex) -> np.ndarray:
        """Return whether robots with such forces on their commands may have stalled, ``(k, c, B, E)``."""
        limits = np.where(robot < 0, *self._limits)
        return np.asarray(np.abs(robot) > STALLED * limits * self.rigidity[index][:, None])

    def _update_contact(
        self, pulls: Pulls, places: np.ndarray, loops: Loops, touching: np.ndarray, index: EnvIndex
    ) -> None:
        """Compare tensions in the robot with lines through the latest ones, and add them to these.

        Where it is open which way a cable last moved, the tensions of both directions are compared. A tension at its
        limit is compared with none, and the robot may have stalled.
        """
        both = self._both_ways(pulls, index)
        stalled = pulls.limited | (self._stalled(both[0], index).mean(axis=(2, 3)).max(axis=1) > 0.5)
        self.stalls[index] = np.where(stalled, STALL_STEPS, np.maximum(self.stalls[index] - 1, 0))
        expected = self._expected(both, loops.inward(index)[..., None], index)
        at = np.broadcast_to(places[..., None], both.shape[1:])
        count, sl, st, sll, slt = (total[index] for total in self._lines)
        spread = sll * count - sl * sl
        compared = (touching & ~pulls.limited)[:, None, None, None]
        known = compared & (spread > 1e-8 * count * count) & (count > 2)
        slope = np.where(known, (slt * count - sl * st) / np.where(known, spread, 1.0), 0.0)
        mean_l, mean_t = (total / np.maximum(count, 1e-9) for total in (sl, st))
        leverage = np.where(
            known, 1 / np.maximum(count, 1.0) + (at - mean_l) ** 2 * count / np.where(known, spread, 1.0), 0.0
        )
        noise = self.noise * np.stack([self._kept, 1 / self._kept])[:, None, None, None]
        variance = noise**2 * (1 + leverage) + (SLIP * both) ** 2
        error = both - mean_t - slope * (at - mean_l)
        likely = np.where(known, -0.5 * error**2 / variance - 0.5 * np.log(variance), 0.0)
        self.inward[index], broken = _judged(expected, likely)
        following = (self.stalls[index] == 0)[:, None, None]
        self._broken[index] += np.where(following, TRUST * broken.sum(axis=1), 0.0)
        robot = _mixed(self.inward[index], *both)
        terms = (np.ones_like(robot), at, robot, at * at, at * robot)
        decay = np.where(touching, SMOOTHNESS, 1.0)[:, None, None, None]
        for total, term in zip(self._lines, terms, strict=True):
            total[index] = decay * total[index] + np.where(compared, term, 0.0)


def _judged(expected: np.ndarray, likely: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the probability of the first of two cases, and the logarithm of the likelihood of both together.

    Args:
        expected: Probability of the first case before anything is seen.
        likely: Logarithms of the likelihoods of what is seen in the cases, ``(2, ...)``.
    """
    with np.errstate(divide="ignore"):
        joint = likely + np.log(np.stack(np.broadcast_arrays(expected, 1 - expected)))
    together = np.logaddexp(*joint)
    return np.exp(joint[0] - together), together


def _mixed(share: np.ndarray, one: np.ndarray, other: np.ndarray) -> np.ndarray:
    """Return a mean of two arrays, by the share of the first."""
    return np.asarray(share * one + (1 - share) * other)
