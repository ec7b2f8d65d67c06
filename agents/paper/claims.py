"""The paper's claims, checked in numbers."""

import math
import time
from dataclasses import dataclass

import numpy as np

from agents.paper import published
from agents.paper.model import ROBOT, calibrate, force_per_load, pull, pull_in_space, table_1
from solver import Scene, tip_slopes

REPEATS = 9  # of a timing, of which the median counts


@dataclass(frozen=True, slots=True)
class Claim:
    """A claim of the paper, and what is found.

    Attributes:
        sentence: What the paper says.
        holds: Whether it holds here.
        found: The numbers.
    """

    sentence: str
    holds: bool
    found: str


def claims() -> list[Claim]:
    """Return every claim, checked."""
    return [
        _peaks_of_multipliers(),
        *_errors_of_table_1(),
        _independence_of_offset(),
        _plane_of_two_cables(),
        *_times(),
    ]


def _peaks_of_multipliers() -> Claim:
    contact = pull(published.FIG_4B, 5.0).contact
    touching = np.flatnonzero(contact.any(axis=(0, 1))).tolist()
    return Claim(
        "The multipliers peak at nodes 11 and 17, the contacts of Fig. 4b (Fig. 5).",
        touching == list(published.FIG_5_NODES) and bool(contact[:, 1].any()),
        f"at l = 5.00 mm the cable points of nodes {[node + 1 for node in touching]} carry multipliers",
    )


def _errors_of_table_1() -> list[Claim]:
    estimator, slopes = calibrate()
    column, measured = table_1(estimator, slopes), np.array(list(published.MEASURED_G.values()))
    deviation = np.abs(column - published.THEORETICAL_G).max()
    errors, printed = np.abs(measured - column), np.abs(measured - published.THEORETICAL_G)
    distance, load = published.CALIBRATION
    return [
        Claim(
            "Theoretical column of Table 1.",
            bool(deviation <= 0.1),
            f"{column.round(1).tolist()} g, at most {deviation:.2f} g off; μ = {estimator.friction:.2f} from d = "
            f"{distance} mm, {load} g, straight-line slopes {slopes.round(3).tolist()}",
        ),
        Claim(
            f"The average error is less than {published.CLAIMED_MEAN_ERROR_G} g.",
            bool(errors.mean() < published.CLAIMED_MEAN_ERROR_G),
            f"{errors.mean():.2f} g over {errors.size} measurements",
        ),
        Claim(
            f"The maximum error is less than {published.CLAIMED_MAX_ERROR_G} g (at d = 26 mm, not in Table 1).",
            bool(printed.max() < published.CLAIMED_MAX_ERROR_G),
            f"Table 1 as printed shows up to {printed.max():.1f} g; here it is {errors.max():.1f} g",
        ),
    ]


def _independence_of_offset() -> Claim:
    estimator, _ = calibrate()
    near, far = (force_per_load(estimator, np.asarray(tip_slopes(ROBOT, cable))) for cable in (2.2, 7.0))
    return Claim(
        "The force does not appreciably change with the offset d.",
        bool(abs(far / near - 1) < 0.05),
        f"with exact slopes the force per load is {near:.4f} at contact with d = 24 mm and {far:.4f} with d = 51 mm; "
        "with one straight line it cannot change",
    )


def _plane_of_two_cables() -> Claim:
    equilibrium = pull_in_space((5.0, 5.0))
    across = equilibrium.points[0] @ [math.sqrt(0.5), -math.sqrt(0.5), 0.0]
    return Claim(
        "Two cables pulled at once bend the robot in a plane between those of each alone (Fig. 11).",
        bool(np.ptp(across) < 1e-9),
        f"pulled by 5 mm each, the backbone stays within {np.ptp(across):.0e} mm of the plane at 45°; "
        f"eq. 13 is met to {equilibrium.residuals()[0]:.0e} rad²/mm",
    )


def _times() -> list[Claim]:
    one, two = _seconds(published.FIG_4A), _seconds(published.FIG_4B)
    return [
        Claim(
            "By specifying the gradient, the convergence time could be further reduced.",
            one < published.SECONDS_PER_SOLVE,
            f"a whole pull from rest to 5 mm, 100 equilibria, takes {1e3 * one:.1f} ms; the paper's fmincon took "
            f"{published.SECONDS_PER_ITERATION} s per iteration without obstacles and {published.SECONDS_PER_SOLVE} s "
            "per solve with them",
        ),
        Claim(
            "One and two obstacles take almost the same time.",
            0.5 < two / one < 2,
            f"two take {two / one:.2f} times as long as one",
        ),
    ]


def _seconds(scene: Scene) -> float:
    """Return the median duration of a pull to 5 mm [s]."""
    return float(np.median([_timed_pull(scene) for _ in range(REPEATS)]))


def _timed_pull(scene: Scene) -> float:
    begin = time.perf_counter()
    pull(scene, 5.0)
    return time.perf_counter() - begin
