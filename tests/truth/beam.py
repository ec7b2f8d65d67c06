"""Beams and chains in motion, which share nothing with the solver: units of length, EI and mass per length are 1.

The unit of time is sqrt(ρA L⁴/EI), so the first natural frequency of the cantilever is 1.875².
"""

import numpy as np
from scipy.integrate import solve_ivp
from scipy.linalg import eigh

ELEMENTS = 24


def matrices(elements: int = ELEMENTS) -> tuple[np.ndarray, np.ndarray]:
    """Stiffness and mass of a clamped Euler–Bernoulli beam of cubic elements; unknowns are deflection and slope."""
    h, size = 1 / elements, 2 * elements + 2
    k = np.array([[12, 6 * h, -12, 6 * h], [6 * h, 4 * h * h, -6 * h, 2 * h * h]])
    k = np.vstack([k, -k[0], [6 * h, 2 * h * h, -6 * h, 4 * h * h]]) / h**3
    m = np.array([[156, 22 * h, 54, -13 * h], [22 * h, 4 * h * h, 13 * h, -3 * h * h]])
    m = np.vstack([m, [54, 13 * h, 156, -22 * h], [-13 * h, -3 * h * h, -22 * h, 4 * h * h]]) * h / 420
    stiffness, mass = np.zeros((size, size)), np.zeros((size, size))
    for element in range(elements):
        at = slice(2 * element, 2 * element + 4)
        stiffness[at, at] += k
        mass[at, at] += m
    return stiffness[2:, 2:], mass[2:, 2:]


def frequency() -> float:
    """First natural frequency [rad per unit of time]."""
    return float(np.sqrt(eigh(*matrices(), eigvals_only=True)[0]))


def swing(prescribed: str, ramp: float, times: np.ndarray) -> np.ndarray:
    """Distance of the tip from that of the equilibrium over the rate of bending, of a ramp that stops at ``ramp``.

    Args:
        prescribed: What the cable prescribes: ``"moment"`` at the tip, or its ``"angle"``.
        ramp: Instant at which the ramp stops.
        times: Instants.
    """
    stiffness, mass = matrices()
    x = np.arange(1, ELEMENTS + 1) / ELEMENTS
    rate = np.column_stack([x**2 / 2, x]).ravel()  # of the equilibrium, for a unit rate of the tip's angle
    free = slice(None) if prescribed == "moment" else slice(-1)  # the last unknown is the tip's angle
    squares, modes = eigh(stiffness[free, free], mass[free, free])
    shares = modes.T @ (mass[free] @ rate)  # velocity that each mode lacks when the ramp starts
    frequencies = np.sqrt(np.maximum(squares, 0))
    tip = modes[-2 if prescribed == "moment" else -1]
    started = np.sin(np.outer(times, frequencies))
    stopped = np.where(times[:, None] > ramp, np.sin(np.outer(times - ramp, frequencies)), 0.0)
    return np.asarray((stopped - started) @ (shares / frequencies * tip))


def chain_error(links: int, rate: float, bend: float, rest: float) -> float:
    """Largest distance of the tip of a chain of rigid links from its equilibrium, at any bend.

    Springs join the links, and the cable turns the last one at a rate to an angle, where it stays for a while.

    Args:
        links: Number of links.
        rate: Rate of the tip's angle.
        bend: Angle at which it stops.
        rest: How long it then stays.
    """
    length = 1 / links
    masses = np.full(links, length)
    masses[-1] /= 2
    carried = np.cumsum(masses[::-1])[::-1]
    coupling = length**2 * np.minimum.outer(carried, carried)
    springs = np.full(links, 1 / length)
    springs[0] *= 2  # the clamp is half a link away
    shape = np.cumsum(1 / springs) / np.sum(1 / springs)

    def command(time: float) -> tuple[float, float]:
        return min(rate * time, bend), rate if rate * time < bend else 0.0

    def tip(angles: np.ndarray) -> np.ndarray:
        return length * np.array([np.sin(angles).sum(), np.cos(angles).sum()])

    def motion(time: float, state: np.ndarray) -> np.ndarray:
        (angle, speed), inner = command(time), links - 1
        angles, speeds = np.append(state[:inner], angle), np.append(state[inner:], speed)
        bent = np.diff(angles, prepend=0.0) * springs
        torques = np.append(bent[1:], 0.0) - bent
        apart = angles[:, None] - angles
        torques -= (coupling * np.sin(apart)) @ speeds**2
        return np.concatenate([speeds[:-1], np.linalg.solve((coupling * np.cos(apart))[:-1, :-1], torques[:-1])])

    end = bend / rate + rest
    times = np.linspace(0, end, 400)
    found = solve_ivp(motion, (0, end), np.zeros(2 * links - 2), t_eval=times, rtol=1e-5, atol=1e-7)
    away = [
        tip(np.append(state[: links - 1], command(t)[0])) - tip(command(t)[0] * shape)
        for t, state in zip(times, found.y.T, strict=True)
    ]
    return float(np.linalg.norm(away, axis=1).max())
