"""Estimates that end at the end of the range in which they are sought, which is then too narrow or the log wrong."""

from agents.estimation.robot import Knowledge
from agents.replay.sensing import Instruments
from ccr_gym import Scales

NEAR = 0.01  # distance from an end of a range at which an estimate counts as being there, over the width
REMEDIES = {
    "rigidity": "check that tensions are in N and displacements in mm, and the rigidity of the robot's file",
    "loss": "check that the log has a reversal before contact, or give a wider tendon_loss with --sensing",
    "play": "give a wider backlash_mm with --sensing, or check that displacements are in mm",
    "latency": "give a wider latency_rows with --sensing, or check that a row is one instant",
}
NAMES = {
    "rigidity": "rigidity over that of the robot's file",
    "loss": "loss of tension to friction",
    "play": "play between motor and cable [mm]",
    "latency": "rows by which positions come late",
}


def warnings_of(known: Knowledge, instruments: Instruments, scales: Scales, seen: bool) -> dict[str, str]:
    """Return what to say of each estimate that is at the end of its range: value, range and remedy, by its name.

    A loss, play or latency of 0 is possible, and nothing is said of it.

    Args:
        known: What is known in the end.
        instruments: The ranges.
        scales: The natural units.
        seen: Whether positions were measured, without which no latency is sought.
    """
    sensing, travel = instruments.sensing, scales.travel_mm
    found = {
        "rigidity": (float(known.rigidity), sensing.rigidity_ratio, 1.0),
        "loss": (float(known.loss), sensing.tendon_loss, 1.0),
        "play": (2 * float(known.half_backlash), sensing.backlash, travel),
    }
    if seen:
        found["latency"] = float(known.latency), sensing.latency, 1.0
    return {
        name: f"{NAMES[name]} is {unit * value:.3g}, at the end of its range, {unit * ends[0]:.3g} to "
        f"{unit * ends[1]:.3g}: {REMEDIES[name]}"
        for name, (value, ends, unit) in found.items()
        if _at_end(value, *ends)
    }


def _at_end(value: float, low: float, high: float) -> bool:
    near = NEAR * (high - low)
    return low < high and (value >= high - near or 0 < low >= value - near)
