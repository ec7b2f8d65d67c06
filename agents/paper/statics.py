"""The paper's claims about contact forces (sections 1, 4 and 6)."""

import numpy as np

from agents.paper import published
from agents.paper.comparison import best_factor
from agents.paper.model import FIT_RANGE_MM, ROBOT, ROD, calibrate, calibrated, force_per_load, path, table_1
from agents.paper.published import LOADS, LOADS_G, MEASURED, MEASURED_G, THEORETICAL_G
from agents.paper.verdict import Claim, Verdict, judged
from solver import HalfPlane, Scene, VirtualWork, fitted_slopes, force_true

TRIALS = 100  # random slopes that the tautology is shown with
GRAZING_MM, PULL_MM = 1e-4, 0.2  # a wall next to the straight robot, and a pull that deflects it little
ERRORS = np.abs(MEASURED - THEORETICAL_G)  # of Table 1 as printed, (4, 7) [g]


def claims() -> list[Claim]:
    """Return the claims about contact forces, judged."""
    return [
        _principle_of_virtual_work(),
        _theoretical_column(),
        _friction(),
        _mean_error(),
        _maximum_error(),
        _error_of_the_introduction(),
        _independence_of_distance(),
        _contact_points(),
    ]


def _principle_of_virtual_work() -> Claim:
    nodes = (ROD.segments // 2, published.CELL_NODE, ROD.segments)
    ratios = {node: estimate_over_force(node) for node in nodes}
    listed = ", ".join(f"{ratio:.2f} at node {node + 1}" for node, ratio in ratios.items())
    return Claim(
        "The principle of virtual work gives the contact force from the kinematics without obstacles (eq. 8–10).",
        "abstract, sections 4, 6",
        judged(all(abs(ratio - 1) < 0.05 for ratio in ratios.values())),
        "a beam with a cable along it, a wall at arc length s and a small deflection has F = P_l·3a/2s; eq. 10 takes "
        f"the tip's free slopes and has F = P_l·2a/L, that is 4s/3L of it. The rod measures {listed}: right near the "
        "third disk from the top by accident, wrong at the tip, where Fig. 6 draws the contact",
    )


def estimate_over_force(node: int) -> float:
    """Return the virtual-work estimate over the energy force of a rod at a wall that one node grazes, μ = 0."""
    wall = HalfPlane(point=(ROD.offset_mm + GRAZING_MM, 0.0), normal=(-1.0, 0.0), nodes=(node,))
    state = path(Scene([wall]), PULL_MM, ROD)[-1]
    return float(VirtualWork().estimate(state)[0, 0] / force_true(state)[0, 0])


def _theoretical_column() -> Claim:
    estimator, slopes = calibrate()
    column = table_1(estimator, slopes)
    off = np.abs(column - THEORETICAL_G).max()
    return Claim(
        "Eq. 11 gives the theoretical column of Table 1.",
        "section 4.1",
        Verdict.UNTESTABLE,
        "a tautology: with straight lines for slopes, F is c·P_l, and μ sets c to one of the 28 measurements. "
        f"{TRIALS} random slopes give the same column to {column_spread():.0e} g. Ours is "
        f"{column.round(1).tolist()} g, up to {off:.2f} g off as printed. Without μ the straight lines of Fig. 7 give "
        f"{force_per_load(VirtualWork(), slopes):.3f} P_l, and the 28 measurements "
        f"{best_factor(np.broadcast_to(LOADS, MEASURED.shape), MEASURED):.3f} P_l",
    )


def column_spread() -> float:
    """Return how much the theoretical column changes over random slopes, μ calibrated anew with each [g]."""
    generator = np.random.default_rng(0)
    trials = generator.uniform([1.0, -9.0, -1.0], [19.0, -1.0, -0.01], (TRIALS, 3))
    columns = [table_1(calibrated(*published.CALIBRATION, slopes), slopes) for slopes in trials]
    return float(np.ptp(columns, axis=0).max())


def _friction() -> Claim:
    slopes = {f"straight lines over 0–{high:.0f} mm": fitted_slopes(ROBOT, 0.0, high) for high in (4.0, 8.0, 12.0)}
    slopes["the slopes of the disk that touches"] = fitted_slopes(ROBOT, *FIT_RANGE_MM, node=published.CELL_NODE)
    friction = {name: calibrated(*published.CALIBRATION, fitted).friction for name, fitted in slopes.items()}
    _, usual = calibrate()
    each = [calibrated(distance, load, usual).friction for distance in MEASURED_G for load in LOADS_G]
    return Claim(
        "The force along the load cell is friction, P_y = μ P_x, with one μ from one data point.",
        "section 4.1",
        Verdict.UNTESTABLE,
        "neither μ nor P_y is printed. μ is "
        f"{', '.join(f'{value:.2f} by {name}' for name, value in friction.items())}, and over "
        f"0–{FIT_RANGE_MM[1]:.0f} mm {min(each):.2f} to {max(each):.2f} by each of the 28 measurements alone. The sign "
        "is that of friction (the disk slides towards the base), the size is not: dry plastic has 0.2 to 0.5. It is a "
        "fit that takes up all that eq. 11 lacks, loss in the cable's holes included",
    )


def _mean_error() -> Claim:
    others, limit = ~published.is_calibration(), published.CLAIMED_MEAN_ERROR_G
    distance, load = published.CALIBRATION
    by_distance = {d: float(row[keep].mean()) for d, row, keep in zip(MEASURED_G, ERRORS, others, strict=True)}
    return Claim(
        f"In all cases, the average error is less than {limit} g.",
        "abstract, sections 4.1, 6",
        judged(max(by_distance.values()) < limit),
        f"Table 1 as printed, without the measurement taken for μ (d = {distance} mm, {load} g): "
        f"{ERRORS[others].mean():.2f} g over {others.sum()} measurements, "
        f"{', '.join(f'{error:.2f} g at {d} mm' for d, error in by_distance.items())}. A straight line through the "
        "origin does as much, see the comparison: it is no evidence for the kinematics. Fig. 10b prints no numbers",
    )


def _maximum_error() -> Claim:
    return Claim(
        f"The experimental results match the theoretical ones with a maximum error of less than "
        f"{published.CLAIMED_MAX_ERROR_G} g.",
        "section 4.1",
        Verdict.UNTESTABLE,
        f"said of Fig. 10a, at d = {published.FIG_10A_MM:.0f} mm, whose numbers are not printed. At the distances of "
        f"Table 1 the largest errors are {ERRORS.max(axis=1).round(1).tolist()} g, the first at 24 mm, next to it",
    )


def _error_of_the_introduction() -> Claim:
    limit = published.CLAIMED_MAX_ERROR
    return Claim(
        f"The contact force can be estimated with a maximum error of {limit:.2%}.",
        "section 1",
        judged(float((ERRORS / MEASURED).max()) < limit),
        f"Table 1 as printed is up to {(ERRORS / MEASURED).max():.0%} of the measured force off, "
        f"{ERRORS.max() / MEASURED.max():.1%} of the largest force, {(ERRORS / LOADS).max():.1%} of the cable load. "
        f"Only as a share of the largest load is it less, {ERRORS.max() / LOADS.max():.2%}. Sections 4 and 5 give "
        "the same number for the pose",
    )


def _independence_of_distance() -> Claim:
    ratios = MEASURED / LOADS
    change, error = trend()
    return Claim(
        "The force is observed not to change appreciably with the offset d.",
        "section 4.1",
        judged(abs(change) < 0.05),
        "a sentence about the experiment, which Table 1 supports: F/P_l is "
        f"{', '.join(f'{ratio:.4f} at {d} mm' for d, ratio in zip(MEASURED_G, ratios.mean(axis=1), strict=True))}; a "
        f"straight line changes by {change:+.1%} ± {error:.1%} from 24 to 51 mm. The load cell resolves 1 g, up to 7 % "
        f"of F at 100 g",
    )


def trend() -> tuple[float, float]:
    """Return the relative change of F/P_l from the nearest to the farthest distance by a straight line, and its error.

    The forces at each distance are reduced to one factor by least squares, so that small ones do not count for more.
    """
    distances = np.array(list(MEASURED_G), float)
    factors = MEASURED @ LOADS / (LOADS @ LOADS)
    (slope, _), covariance = np.polyfit(distances, factors, 1, cov=True)
    scale = np.ptp(distances) / factors.mean()
    return float(slope * scale), float(np.sqrt(covariance[0, 0]) * scale)


def _contact_points() -> Claim:
    estimator, tip = calibrate()
    own = force_per_load(estimator, fitted_slopes(ROBOT, *FIT_RANGE_MM, node=published.CELL_NODE))
    error = float(np.abs(own * LOADS - MEASURED).mean())
    return Claim(
        "Eq. 11 gives the force at different contact points of the robot (Fig. 10b).",
        "section 4.1",
        judged(error < published.CLAIMED_MEAN_ERROR_G),
        "Fig. 10a and 10b cannot both be eq. 11 for the third disk from the top. With the tip's slopes, as in 10a, "
        f"every disk has {force_per_load(estimator, tip):.3f} P_l and 10b is one line; with those of the disk that "
        f"touches, which set its lines apart, that disk has {own:.3f} P_l, {error:.1f} g off the 28 measurements on "
        "average. The figure's own numbers are not printed",
    )
