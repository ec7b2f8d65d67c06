"""The page: the scene, with panels of controls, numbers and charts beside it."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import viser

from agents.play.choices import MODELS, SENSINGS
from agents.play.controls import KEYS, Controls
from agents.play.frame import Frame
from agents.play.inputs import Inputs, set_value
from agents.play.plots import Plots
from agents.play.recorder import EVERY, Recorder
from agents.play.session import Session
from agents.play.shapes import to_robot
from agents.play.status import status_html
from agents.play.world import World
from ccr_gym import ENV_IDS
from solver import PRESETS

SLOW = 8  # ticks between updates of numbers, charts and sliders, each of which costs a browser more than the scene
TITLE = "ccr-gym play"
NUDGE = 4.0  # full actions of a key
CHOICES = {
    "env_id": ("Task", tuple(ENV_IDS)),
    "robot": ("Robot", tuple(PRESETS)),
    "model": ("Model", MODELS),
    "sensing": ("Sensing", SENSINGS),
}


class Page:
    """Shows a session and hands it what the user does, between two ticks.

    Args:
        server: The server.
        session: The session.
        recorder: Writer of GIFs.
    """

    def __init__(self, server: viser.ViserServer, session: Session, recorder: Recorder) -> None:
        self._server, self._session, self._recorder, self._inputs = server, session, recorder, Inputs()
        self._ticks, self._generation, self._stops = 0, session.generation, session.dragging.stops
        _configure(server)
        tabs = server.gui.add_tab_group()
        self._drive, self._charts = tabs.add_tab("Drive"), _charts_panel(server).add_tab("Over time")
        with tabs.add_tab("Setting"):
            self._choices = {name: self._add_choice(name) for name in CHOICES}
        self._add_keys()
        frame = session.tick()
        with self._drive:
            self._status = server.gui.add_html(self._status_html(frame))
            server.gui.add_html(f"<style onload=\"document.title = '{TITLE}'\"></style>")
            self._controls = Controls(server.gui, session, self._inputs, self._toggle_recording)
        with self._charts:
            self._plots = Plots(server.gui, len(frame.numbers.tensions))
        self._world = self._new_world(frame)

    def tick(self) -> None:
        """Take in what the user did, move the session by a step and show it."""
        self._inputs.run()
        frame = self._session.tick()
        with self._server.atomic():
            if self._session.generation != self._generation:
                self._rebuild(frame)
            self._show(frame)
        self._record()
        self._ticks += 1

    def _show(self, frame: Frame) -> None:
        session = self._session
        if session.dragging.stops != self._stops:
            self._stops = session.dragging.stops
            self._world.release()
        self._world.show(frame)
        self._plots.add(frame.numbers)
        if self._ticks % SLOW == 0:
            self._status.content = self._status_html(frame)
            self._plots.draw()
            self._controls.follow(frame.numbers)
            for name, dropdown in self._choices.items():
                set_value(dropdown, getattr(session.choices, name))

    def _rebuild(self, frame: Frame) -> None:
        """Show another environment."""
        self._generation, self._stops = self._session.generation, self._session.dragging.stops
        self._world = self._new_world(frame)
        with self._drive:
            self._controls.fit()
        with self._charts:
            self._plots.fit(len(frame.numbers.tensions))

    def _new_world(self, frame: Frame) -> World:
        settings = self._session.env.settings
        length, radius = settings.scales.length_mm, float(settings.robot.edge_mm)
        return World(self._server, frame, length, radius, self._dragged)

    def _status_html(self, frame: Frame) -> str:
        return status_html(frame.numbers, len(frame.contacts.points), self._ticks)

    def _add_choice(self, name: str) -> viser.GuiDropdownHandle[str]:
        session, (label, values) = self._session, CHOICES[name]
        dropdown = self._server.gui.add_dropdown(label, values, initial_value=str(getattr(session.choices, name)))
        self._inputs.on_value(dropdown, lambda value: session.choose(name, value))
        return dropdown

    def _add_keys(self) -> None:
        session, inputs, gui = self._session, self._inputs, self._server.gui
        for index, (pull, pay_out) in enumerate(KEYS):
            inputs.on_key(gui, f"Pull {index + 1}", pull, self._nudge(index, NUDGE))
            inputs.on_key(gui, f"Pay out {index + 1}", pay_out, self._nudge(index, -NUDGE))
        inputs.on_key(gui, "New scene", "N", session.new_scene)
        inputs.on_key(gui, "Straighten", "T", session.straighten)
        inputs.on_key(gui, "Pause or go on", "space", session.pause)
        inputs.on_key(gui, "Record a GIF", "G", self._toggle_recording)

    def _nudge(self, index: int, increments: float) -> Callable[[], None]:
        return lambda: self._session.nudge(index, increments)

    def _dragged(self, index: int, middle: np.ndarray) -> None:
        self._inputs.put(lambda: self._drag(index, middle))

    def _drag(self, index: int, middle: np.ndarray) -> None:
        session = self._session
        space, length = session.equilibrium.forces.shape[1], session.env.settings.scales.length_mm
        session.drag(index, to_robot(middle, length, space))

    def _toggle_recording(self) -> None:
        """Begin a GIF, or end it and let the browsers download it."""
        try:
            if self._recorder.path is None:
                self._recorder.start()
            else:
                self._hand_out(self._recorder.stop())
        except OSError as error:
            self._session.say(f"no GIF: {error}")
        self._controls.show_recording(self._recorder.path is not None)

    def _hand_out(self, path: Path | None) -> None:
        if path is not None:
            self._server.send_file_download(path.name, path.read_bytes(), save_immediately=True)
            self._session.say(f"written: {path}")

    def _record(self) -> None:
        recorder = self._recorder
        if recorder.path is None or self._ticks % EVERY:
            return
        try:
            recorder.add(self._session.picture())
        except OSError as error:
            recorder.stop()
            self._controls.show_recording(False)
            self._session.say(f"no GIF: {str(error).splitlines()[0]}")
        if recorder.full:
            self._toggle_recording()


def _configure(server: viser.ViserServer) -> None:
    server.gui.configure_theme(show_logo=False, show_share_button=False, brand_color=(33, 60, 114))
    server.gui.set_panel_label(TITLE)
    server.gui.main_panel.dock_right()
    server.scene.set_up_direction("+z")
    server.scene.configure_default_lights(cast_shadow=False)
    server.scene.configure_environment_map(None)


def _charts_panel(server: viser.ViserServer) -> viser.PanelHandle:
    panel = server.gui.add_panel()
    panel.dock_left()
    return panel
