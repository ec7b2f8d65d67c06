"""The paper's claims about computing times (section 5), like compared with like.

fmincon is MATLAB's; SciPy's SLSQP, a sequential quadratic program too, takes its place on eq. 5 as the paper states it.
Every solve is one increment of the same size, from a robot that touches what it is to touch all the while.
"""

import time
from typing import NamedTuple

import numpy as np

from agents.paper import eq_5, published
from agents.paper.model import ROBOT, pull
from agents.paper.verdict import Claim, Verdict, judged
from solver import Equilibrium, Scene, Solver

INCREMENT_MM, STEPS = 0.25, 100  # of a solve by SLSQP; of the kernel within the same increment
REPEATS = 9  # of the kernel's steps, of which the median counts
ALMOST = 2.0  # ratio of two times that are no longer almost the same; runs differ by a few tens of percent


class Timing(NamedTuple):
    """What an increment took, and how many obstacles were touched on the way.

    Attributes:
        touched: Number of obstacles touched, at least, in any of the kernel's equilibria.
        kernel: Time of the increment in the kernel, in :data:`STEPS` steps [s].
        slsqp: Time by SLSQP without gradients [s].
        iterations: Iterations of SLSQP.
        error_mm: Largest distance of a point of SLSQP from the kernel's.
    """

    touched: int
    kernel: float
    slsqp: float
    iterations: int
    error_mm: float


def starts() -> dict[str, Equilibrium]:
    """Return where the increments start: a free robot, and robots in touch with one and with two obstacles."""
    return {
        "no": pull(Scene(), 5.1),
        "one": pull(published.FIG_4A, 5.1),  # first contact at 5.05 mm
        "two": pull(published.FIG_4B, 4.8),  # both are touched from 4.80 to 5.10 mm
    }


def claims() -> list[Claim]:
    """Return the claims about computing times, judged."""
    timings = {name: measure(start) for name, start in starts().items()}
    return [_gradient(starts()["one"]), _one_and_two(timings), _obstacles(timings)]


def measure(start: Equilibrium) -> Timing:
    """Time an increment from an equilibrium."""
    solver = Solver(ROBOT, start.scene)
    times, states = zip(*(_timed_steps(solver, start) for _ in range(REPEATS)), strict=True)
    solution = eq_5.solve(start, start.cable_mm + INCREMENT_MM, with_gradient=False)
    return Timing(
        touched=min(int(state.contact.any(axis=(1, 2)).sum()) for state in states[0]),
        kernel=float(np.median(times)),
        slsqp=solution.seconds,
        iterations=solution.iterations,
        error_mm=_error(solution, states[0][-1]),
    )


def _timed_steps(solver: Solver, start: Equilibrium) -> tuple[float, list[Equilibrium]]:
    states = [start]
    begin = time.process_time()
    for cable in start.cable_mm + INCREMENT_MM * np.arange(1, STEPS + 1) / STEPS:
        states.append(solver.step(states[-1], float(cable)))
    return time.process_time() - begin, states


def _error(solution: eq_5.Solution, state: Equilibrium) -> float:
    return float(np.abs(solution.points - eq_5.node_points(state)).max())


def _gradient(start: Equilibrium) -> Claim:
    goal = start.cable_mm + INCREMENT_MM
    without, objective, every = (
        eq_5.solve(start, goal, with_gradient=gradient, with_slopes=slopes)
        for gradient, slopes in ((False, False), (True, False), (True, True))
    )
    return Claim(
        "By specifying the gradient, the convergence time could be further reduced.",
        "section 5",
        judged(objective.seconds < without.seconds),
        f"SLSQP on eq. 5, an increment of {INCREMENT_MM} mm at the obstacle of Fig. 4a: {without.seconds:.2f} s and "
        f"{without.iterations} iterations without gradients, {objective.seconds:.2f} s and {objective.iterations} with "
        f"the objective's, {every.seconds:.2f} s and {every.iterations} with those of the constraints as well",
    )


def _one_and_two(timings: dict[str, Timing]) -> Claim:
    one, two = timings["one"], timings["two"]
    ratio = two.slsqp / one.slsqp
    return Claim(
        "The time for one and for two obstacles is almost the same.",
        "section 5",
        judged(1 / ALMOST < ratio < ALMOST),
        f"SLSQP without gradients takes {one.slsqp:.2f} s and {one.iterations} iterations with one obstacle touched, "
        f"{two.slsqp:.2f} s and {two.iterations} with two, {ratio:.2f} times as long; the kernel {_micro(one)} and "
        f"{_micro(two)} µs a step",
    )


def _obstacles(timings: dict[str, Timing]) -> Claim:
    none, one, two = timings.values()
    return Claim(
        "As expected, the convergence of problems with obstacles is slower than without.",
        "section 5",
        Verdict.UNTESTABLE,
        f"the paper prints {published.SECONDS_PER_ITERATION} s an iteration without and "
        f"{published.SECONDS_PER_SOLVE:.0f} s a solve with obstacles, which do not compare, and neither guess nor "
        f"tolerance. It depends on the optimiser: SLSQP without gradients takes {none.iterations} iterations without "
        f"obstacles, {one.iterations} with one and {two.iterations} with two ({none.slsqp:.2f}, {one.slsqp:.2f} and "
        f"{two.slsqp:.2f} s), the kernel {_micro(none)}, {_micro(one)} and {_micro(two)} µs a step",
    )


def _micro(timing: Timing) -> str:
    return f"{1e6 * timing.kernel / STEPS:.0f}"
