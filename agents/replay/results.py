"""What a replay writes: one CSV with a row for each row of the log, one with the shapes, and a summary."""

import csv
import json
from collections.abc import Iterable, Sequence
from pathlib import Path

import numpy as np

from agents.files import replacing, write_text
from agents.replay.estimate import Estimates

Column = Sequence[object] | np.ndarray
AXES = "xyz"
DIGITS = 6  # significant ones of what is written


def write_results(found: Estimates, out: Path) -> None:
    """Write estimate.csv, shape.csv and estimate.json to a folder.

    Raises:
        UserError: If a file cannot be written.
    """
    columns = result_columns(found)
    _write(out / "estimate.csv", list(columns), zip(*columns.values(), strict=True))
    _write(out / "shape.csv", *_shape_table(found))
    write_text(out / "estimate.json", json.dumps(summary(found), indent=2) + "\n")


def result_columns(found: Estimates) -> dict[str, Column]:
    """Return the columns of estimate.csv by name, each with an entry for each row of the log."""
    columns: dict[str, Column] = {"row": found.log.rows.tolist()}
    if found.log.time_s is not None:
        columns["time_s"] = found.log.time_s
    columns |= {"force_n": found.force_n, "force_std_n": found.force_std_n}
    columns |= _by_axis("force", found.obstacle_forces_n.sum(axis=1))
    if found.obstacle_forces_n.shape[1] > 1:
        for obstacle, forces in enumerate(np.moveaxis(found.obstacle_forces_n, 1, 0)):
            columns |= _by_axis(f"force_on_{obstacle}", forces)
    columns |= {"contacts": [contacts(shape.contact) for shape in found.shapes]}
    columns |= _hidden(found)
    columns |= {"status": [shape.status.name for shape in found.shapes]}
    if found.log.nodes.size:
        columns["position_error_mm"] = found.position_errors_mm
    return columns


def _by_axis(name: str, vectors: np.ndarray) -> dict[str, np.ndarray]:
    return {f"{name}_{axis}_n": vectors[:, place] for place, axis in enumerate(AXES[: vectors.shape[1]])}


def _hidden(found: Estimates) -> dict[str, np.ndarray]:
    """Return what is known of the robot itself, with standard deviations."""
    travel, cables = found.scales.travel_mm, found.scales.travel_mm * found.history("cables")
    sections = [""] if cables.shape[1] == 1 else [f"_{section}" for section in range(cables.shape[1])]
    values = {f"command{name}_mm": cables[:, section] for section, name in enumerate(sections)}
    values |= {"rigidity_ratio": found.history("rigidity"), "rigidity_ratio_std": found.history("rigidity_std")}
    values |= {"tendon_loss": found.history("loss"), "tendon_loss_std": found.history("loss_std")}
    values |= {"backlash_mm": 2 * travel * found.history("half_backlash")}
    return values | {"backlash_std_mm": 2 * travel * found.history("half_backlash_std")}


def contacts(contact: np.ndarray) -> str:
    """Return which obstacles touch which nodes, such as ``0:11 0:12 1:17``, from flags ``(m, p, k)``."""
    touching = np.argwhere(contact.any(axis=1))
    return " ".join(f"{obstacle}:{position}" for obstacle, position in touching.tolist())


def summary(found: Estimates) -> dict[str, object]:
    """Return what is known at the end, with standard deviations, and how large the force became."""
    hidden = {name: _rounded(values[-1]) for name, values in _hidden(found).items()}
    largest = int(found.force_n.argmax())
    force = {"force_n": _rounded(found.force_n[largest]), "force_std_n": _rounded(found.force_std_n[largest])}
    largest_force = {"row": int(found.log.rows[largest]), **force} if found.force_n[largest] > 0 else None
    known: dict[str, object] = {"rows": len(found.log.rows), "at_the_end": hidden, "largest_force": largest_force}
    known |= {"warnings": list(found.warnings.values())}
    if found.log.nodes.size:
        known |= {"latency_rows": found.latency_rows, "latency_rows_std": _rounded(found.known[-1].latency_std)}
        known |= {"median_position_error_mm": _rounded(np.median(found.position_errors_mm))}
    return known


def _rounded(value: float | np.ndarray) -> float:
    return float(f"{float(value):.{DIGITS}g}")


def _shape_table(found: Estimates) -> tuple[list[str], Iterable[Sequence[object]]]:
    space = found.obstacle_forces_n.shape[2]
    header = ["row", "node", *(f"{axis}_mm" for axis in AXES[:space])]
    rows = zip(found.log.rows.tolist(), found.shapes, strict=True)
    return header, ((row, node, *place[:space]) for row, shape in rows for node, place in enumerate(shape.nodes))


def _write(path: Path, header: Sequence[str], rows: Iterable[Sequence[object]]) -> None:
    with replacing(path) as partial, partial.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(header)
        writer.writerows([_shown(cell) for cell in row] for row in rows)


def _shown(cell: object) -> object:
    return f"{cell:.{DIGITS}g}" if isinstance(cell, float) else cell
