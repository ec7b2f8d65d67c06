"""Drags and resizes obstacles at random for some minutes on a page of ``ccr-gym play`` while policies drive.

Prints the errors and the memory of the process every minute: both must stay flat. Usage: python benchmarks/dragging.py
[minutes] [port]; open the page at that port to have a browser draw it all.
"""

import sys
import time
from pathlib import Path

import numpy as np
import psutil
import viser

from agents.play.choices import Choices
from agents.play.page import Page
from agents.play.recorder import Recorder
from agents.play.session import Session

RATE = 40.0  # updates a second
SCENE_TICKS = 1200  # after which another environment or driver is chosen
PLAYED = ("CCR/PushObstacle-v1", "CCR/BracedPush-v1", "CCR/SoftObstacle-v1", "CCR/SpatialPush-v1", "CCR/LoadCell-v1")
DRIVERS = ("Hand", "PI", "MPC", "Distilled")


def disturb(session: Session, generator: np.random.Generator) -> None:
    """Drag an obstacle, and now and then give it another size or pull a cable."""
    scene, spec = session.equilibrium.scene.obstacles, session.env.action_spec
    index, length = int(generator.integers(len(scene))), session.env.settings.scales.length_mm
    center = np.array(scene[index].extent.center)
    session.drag(index, tuple((0.5 * center + 0.5 * length * generator.normal(size=center.shape)).tolist()))
    if generator.random() < 0.2:
        session.resize(index, float(generator.uniform(0.5, 1.5)))
    if session.choices.driver == "Hand":
        session.pull(0, float(generator.uniform(spec.low_mm[0], spec.high_mm[0])))


def main(minutes: float, port: int) -> int:
    """Run for some minutes; return the number of errors."""
    generator, session = np.random.default_rng(0), Session(Choices())
    server = viser.ViserServer("127.0.0.1", port, verbose=False)
    page, process, start = Page(server, session, Recorder(Path("runs/play"))), psutil.Process(), time.time()
    ticks, slowest, shown, stops = 0, 0.0, 0, 0
    while time.time() < start + 60 * minutes:
        if ticks % SCENE_TICKS == 0:
            session.choose("env_id", PLAYED[ticks // SCENE_TICKS % len(PLAYED)])
            session.choose("driver", DRIVERS[ticks // SCENE_TICKS % len(DRIVERS)])
        if ticks % 20 == 0:
            disturb(session, generator)
        began = time.process_time()
        page.tick()
        slowest, ticks = max(slowest, time.process_time() - began), ticks + 1
        time.sleep(max(0.0, start + ticks / RATE - time.time()))
        if time.time() > start + 60 * shown:
            stops, shown = session.dragging.stops, shown + 1
            memory = process.memory_info().rss / 2**20
            print(
                f"{(time.time() - start) / 60:5.1f} min, {ticks} ticks, {session.faults} errors, {stops} stops in this "
                f"scene, {memory:.0f} MiB, slowest tick {1e3 * slowest:.0f} ms of CPU", flush=True,
            )  # fmt: skip
    server.stop()
    return session.faults


if __name__ == "__main__":
    minutes, port = (*sys.argv[1:], "10", "8300")[:2] if len(sys.argv) != 2 else (sys.argv[1], "8300")
    sys.exit(main(float(minutes), int(port)))
