"""Compare the force that ``ccr-gym estimate`` found in the example's log with the truth, which the log does not hold.

Run ``ccr-gym estimate examples/estimate/log.csv --robot examples/estimate/robot.json --scene
examples/estimate/scene.json``, then ``python examples/estimate/check.py``; it writes
runs/estimate/check.png.
"""

import csv
from dataclasses import dataclass
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
import tyro

HERE = Path(__file__).parent


@dataclass(frozen=True)
class Args:
    """Print how often the truth is within two standard deviations of the estimate, and draw both."""

    results: Path = Path("runs/estimate")
    """Folder that ``ccr-gym estimate`` wrote."""
    truth: Path = HERE / "truth.csv"
    """The truth."""
    out: Path = Path("runs/estimate/check.png")
    """Figure to write."""


def column(path: Path, name: str) -> np.ndarray:
    """Return a column of a CSV file."""
    with path.open() as file:
        return np.array([float(row[name]) for row in csv.DictReader(file)])


def main(args: Args) -> None:
    """Print and draw the comparison."""
    estimate = args.results / "estimate.csv"
    time, force, deviation = (column(estimate, name) for name in ("time_s", "force_n", "force_std_n"))
    truth = column(args.truth, "force_n")
    near, pressed = np.abs(force - truth) <= 2 * deviation, truth > 0
    error = np.median(np.abs(force - truth)[pressed] / truth[pressed])
    print(f"The true force is within two standard deviations in {100 * near.mean():.0f} % of {len(near)} rows,")
    print(f"in {100 * near[pressed].mean():.0f} % of those in contact; the median error there is {100 * error:.1f} %.")
    figure, axis = plt.subplots(figsize=(7, 3), layout="constrained")
    axis.fill_between(time, force - 2 * deviation, force + 2 * deviation, alpha=0.25, label="± 2 standard deviations")
    axis.plot(time, force, label="estimated")
    axis.plot(time, truth, "k--", lw=1, label="true")
    axis.set(xlabel="time [s]", ylabel="contact force [N]")
    axis.legend()
    args.out.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(args.out, dpi=130)
    print(f"Written: {args.out}")


if __name__ == "__main__":
    main(tyro.cli(Args))
