"""The command ``ccr-gym estimate``: from the files of a robot to results."""

from agents.config import EstimateConfig
from agents.errors import UserError
from agents.files import check_writable
from agents.replay.estimate import Estimates, estimate_log
from agents.replay.log import read_log
from agents.replay.results import write_results
from agents.replay.robots import read_robot
from agents.replay.scenes import read_scene
from agents.replay.sensing import read_instruments

WRITTEN = ("estimate.csv", "shape.csv", "estimate.json", "estimate.png")


def run(config: EstimateConfig) -> Estimates:
    """Replay a log, write the results to a folder, and return them.

    Raises:
        UserError: If a file is not as documented, or cannot be written.
    """
    from agents.replay.figure import draw

    robot = read_robot(config.robot)
    scene = read_scene(config.scene, robot)
    instruments = read_instruments(config.sensing, robot)
    log = read_log(config.log, robot)
    check_writable(*(config.out / name for name in WRITTEN))
    try:
        found = estimate_log(log.averaged(config.every), robot, scene, instruments, str(config.log))
    except ValueError as error:
        raise UserError(f"{config.log}: {error}") from error
    write_results(found, config.out)
    draw(found, config.out / "estimate.png")
    return found
