"""Logs of a robot: one row for each instant, read from CSV and checked cell by cell."""

import csv
import io
import math
import re
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Self

import numpy as np

from agents.errors import UserError
from agents.replay.json_files import read_text
from agents.replay.robots import AnyRobot, check_robot
from solver import Robot

MOST_ROWS = 200_000
MOST = 1e9  # size of a number in a log
MOST_COLUMNS = 20_000
ENCODER_NOISE = 0.02  # by which a displacement may be out of range, which is then clipped [a]
POSITION = re.compile(r"(tip|node_(\d{1,4}))_([xyz])_mm")


@dataclass(frozen=True, slots=True)
class Log:
    """What a robot has logged, in K rows.

    Attributes:
        rows: Line of the file of each entry, the header being line 1, ``(K,)``.
        time_s: Time, ``(K,)`` [s]; None where it was not logged.
        cables_mm: Displacement of each cable, positive where it is pulled, ``(K, c)`` [mm].
        tensions_n: Tension of each cable as its motor feels it, ``(K, c)`` [N].
        nodes: Nodes whose positions were measured, ``(m,)``.
        positions_mm: Their positions, ``(K, m, d)`` [mm].
    """

    rows: np.ndarray
    time_s: np.ndarray | None
    cables_mm: np.ndarray
    tensions_n: np.ndarray
    nodes: np.ndarray
    positions_mm: np.ndarray

    def check_fits(self, robot: AnyRobot) -> None:
        """Check that the log can be that of a robot.

        Raises:
            ValueError: If it has other cables, nodes or axes.
        """
        cables, last = self.cables_mm.shape[1], int(self.nodes.max(initial=0))
        if cables != len(robot.cables) or last > robot.segments or self.positions_mm.shape[2] != len(_axes(robot)):
            raise ValueError(
                f"log has {cables} cables, {self.positions_mm.shape[2]} axes and node {last}; robot has "
                f"{len(robot.cables)} cables, {len(_axes(robot))} axes and {robot.segments} segments: "
                "read_log(path, robot) reads the log of a robot"
            )

    def averaged(self, count: int) -> Self:
        """Return the log with the means of each ``count`` consecutive rows as one row; an incomplete rest is left out.

        Raises:
            ValueError: If there are fewer rows.
        """
        if len(self.rows) < count:
            raise ValueError(f"every is {count}; it must be at most {len(self.rows)}, the number of rows")

        def mean(values: np.ndarray) -> np.ndarray:
            means = len(values) // count
            return np.asarray(values[: means * count].reshape(means, count, *values.shape[1:]).mean(axis=1))

        time = None if self.time_s is None else mean(self.time_s)
        means = {name: mean(getattr(self, name)) for name in ("cables_mm", "tensions_n", "positions_mm")}
        return replace(self, rows=self.rows[count - 1 :: count], time_s=time, **means)


def _axes(robot: AnyRobot) -> str:
    return "xy" if isinstance(robot, Robot) else "xyz"


def cable_columns(robot: AnyRobot) -> tuple[list[str], list[str]]:
    """Return the names of the columns with displacements and tensions of a robot's cables."""
    count = len(robot.cables)
    names = [""] if count == 1 else [f"_{cable}" for cable in range(count)]
    return [f"cable{name}_mm" for name in names], [f"tension{name}_n" for name in names]


def read_log(path: Path | str, robot: AnyRobot) -> Log:
    """Return the log of a CSV file.

    Raises:
        TypeError: If the robot or the path is none.
        UserError: If the header or a cell is not as documented, naming line and column.
    """
    check_robot(robot)
    path = Path(path) if isinstance(path, str) else path
    header, rows, numbers = _table(path)
    displacements, tensions = cable_columns(robot)
    axes = _axes(robot)
    nodes, positions = _position_columns(path, header, robot, axes)
    _check_header(path, header, [*displacements, *tensions], [name for group in positions for name in group])
    columns = {name: numbers[:, place] for place, name in enumerate(header)}
    time = columns.get("time_s")
    if time is not None:
        _check_times(path, rows, time)
    cables = np.column_stack([columns[name] for name in displacements])
    _check_range(path, rows, displacements, cables, robot)
    cables = np.clip(cables, robot.least_cable_mm, robot.cable_limit_mm)
    tensions_n = np.column_stack([columns[name] for name in tensions])
    _check_signs(path, tensions_n, cables)
    places = [[columns[name] for name in group] for group in positions]
    return Log(
        rows=rows,
        time_s=time,
        cables_mm=cables,
        tensions_n=tensions_n,
        nodes=np.array(nodes, int),
        positions_mm=np.array(places).reshape(len(nodes), len(axes), len(rows)).transpose(2, 0, 1),
    )


def _table(path: Path) -> tuple[list[str], np.ndarray, np.ndarray]:
    """Return header, numbers of rows in the file, and the numbers ``(K, columns)``; empty rows are left out."""
    reader = csv.reader(io.StringIO(read_text(path), newline=""), strict=True)
    header: list[str] = []
    rows, numbers = [], []
    try:
        for cells in reader:
            if not any(cell.strip() for cell in cells):
                continue
            if not header:
                header = [cell.strip() for cell in cells[:MOST_COLUMNS]]
                _check_separator(path, header)
                continue
            rows.append(reader.line_num)
            numbers.append(_numbers(path, header, reader.line_num, cells))
            if len(rows) > MOST_ROWS:
                raise UserError(f"{path} has more than {MOST_ROWS} rows; log less often, or cut the file")
    except csv.Error as error:
        raise UserError(f"{path}, line {reader.line_num}: {error}") from error
    if not rows:
        raise UserError(f"{path} has no rows of numbers below a header")
    return header, np.array(rows), np.array(numbers)


def _check_separator(path: Path, header: list[str]) -> None:
    """Refuse a file whose cells are not separated by commas, as spreadsheets of many countries write them."""
    for sign, name in ((";", "semicolons"), ("\t", "tabs")):
        if len(header) == 1 and sign in header[0]:
            raise UserError(
                f"{path}: cells are separated by {name}; they must be separated by commas, and numbers have decimal "
                "points: export the log as comma-separated values"
            )


def _numbers(path: Path, header: list[str], row: int, cells: list[str]) -> list[float]:
    if len(cells) != len(header):
        raise UserError(f"{path}, line {row}: there are {len(cells)} cells; the header has {len(header)}")
    return [_number(path, row, name, cell) for name, cell in zip(header, cells, strict=True)]


def _number(path: Path, row: int, name: str, cell: str) -> float:
    try:
        value = math.nan if "_" in cell else float(cell)  # Python reads 1_000, other programs do not
    except ValueError:
        value = math.nan
    if not abs(value) <= MOST:
        what = f"{cell[:40]!r} is not a number up to {MOST:g} in size" if cell.strip() else "the cell is empty"
        raise UserError(f"{path}, line {row}, column {name}: {what}")
    return value


def _position_columns(path: Path, header: list[str], robot: AnyRobot, axes: str) -> tuple[list[int], list[list[str]]]:
    """Return the nodes that were measured, and the names of the columns of each."""
    found: dict[int, list[str]] = {}
    for name in header:
        match = POSITION.fullmatch(name)
        if match and match[3] in axes:
            node = robot.segments if match[1] == "tip" else int(match[2])
            if not 1 <= node <= robot.segments:
                raise UserError(f"{path}, column {name}: the nodes of this robot are 1 to {robot.segments}, its tip")
            prefix = f"{match[1]}_"
            found.setdefault(node, [f"{prefix}{axis}_mm" for axis in axes])
    return list(found), list(found.values())


def _check_header(path: Path, header: list[str], needed: list[str], positions: list[str]) -> None:
    wanted = f"{', '.join(needed)}, and if they were measured time_s, tip_x_mm, tip_y_mm, … or node_1_x_mm, …"
    for name in [*needed, *positions]:
        if name not in header:
            raise UserError(f"{path}, line 1: the column {name} is missing; the columns are {wanted}")
    for name in header:
        if header.count(name) > 1:
            raise UserError(f"{path}, line 1: the column {name} is given twice")
        if name not in (*needed, *positions, "time_s"):
            raise UserError(f"{path}, line 1: the column {name!r} is unknown; the columns are {wanted}")


def _check_times(path: Path, rows: np.ndarray, time: np.ndarray) -> None:
    for row, before, now in zip(rows[1:], time, time[1:], strict=False):
        if not now > before:
            raise UserError(f"{path}, line {row}, column time_s: {now:g} must be above {before:g}, the line before")


def _check_signs(path: Path, tensions_n: np.ndarray, cables: np.ndarray) -> None:
    """Check that cables that are pulled are under tension, and not under compression, on average."""
    pulled = tensions_n[cables > 0]
    if pulled.size and pulled.mean() < -np.abs(pulled - pulled.mean()).mean():
        raise UserError(
            f"{path}: tensions of pulled cables are {pulled.mean():.3g} N on average; they must be positive where a "
            "cable pulls: turn their sign, or that of the displacements"
        )


def _check_range(path: Path, rows: np.ndarray, names: list[str], cables: np.ndarray, robot: AnyRobot) -> None:
    low, high, noise = robot.least_cable_mm, robot.cable_limit_mm, ENCODER_NOISE * robot.offset_mm
    for row, column in np.argwhere((cables < low - noise) | (cables > high + noise)):
        raise UserError(
            f"{path}, line {rows[row]}, column {names[column]}: {cables[row, column]:g} is out of range; it must be "
            f"from {low:.6g} to {high:.6g} mm, the max_cable_mm of the robot"
        )
