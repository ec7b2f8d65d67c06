"""The page: panels with choices, sliders, keys and numbers, around the scene."""

import html
from collections.abc import Callable
from queue import SimpleQueue
from typing import Any

import numpy as np
import viser

from agents.play.choices import MODELS, SENSINGS, drivers
from agents.play.dragging import RATIOS
from agents.play.frame import Frame, Numbers
from agents.play.plots import Plots
from agents.play.recorder import EVERY, Recorder
from agents.play.session import Session
from agents.play.shapes import to_robot
from agents.play.world import World
from ccr_gym import ENV_IDS
from solver import PRESETS

SLOW = 8  # ticks between updates of plots and sliders, which a browser draws slowly
NUDGE = 4.0  # full actions of a key
KEYS = (("K", "J"), ("L", "H"), ("O", "U"), ("P", "Y"))  # that pull and pay out each actuated coordinate
GOOD, BAD = "#008c7e", "#d01842"
MILLI = 1e3


class Page:
    """Shows a session and hands it what the user does, between two ticks.

    Args:
        server: The server.
        session: The session.
        recorder: Writer of GIFs.
    """

    def __init__(self, server: viser.ViserServer, session: Session, recorder: Recorder) -> None:
        self._server, self._session, self._recorder = server, session, recorder
        self._inputs: SimpleQueue[Callable[[], None]] = SimpleQueue()
        self._generation, self._ticks, self._scene_step = 0, 0, 0
        server.gui.configure_theme(show_logo=False, show_share_button=False, brand_color=(33, 60, 114))
        server.gui.set_panel_label("ccr-gym play")
        server.scene.set_up_direction("+z")
        server.scene.configure_default_lights(cast_shadow=False)
        server.scene.configure_environment_map(None)
        server.gui.main_panel.dock_right()
        self._plots_panel = server.gui.add_panel()
        self._plots_panel.dock_left()
        self._add_commands()
        self._build(session.tick())

    def tick(self) -> None:
        """Take in what the user did, move the session by a step and show it."""
        while not self._inputs.empty():
            self._inputs.get()()
        frame = self._session.tick()
        if self._session.generation != self._generation:
            self._build(frame)
        with self._server.atomic():
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
        self._status.content = status_html(frame.numbers, len(frame.contacts.points), self._ticks)
        if self._ticks % SLOW == 0:
            self._plots.draw()
            self._follow(frame.numbers)

    def _build(self, frame: Frame) -> None:
        """Build panels and scene for another environment."""
        session, gui = self._session, self._server.gui
        if self._generation:
            for part in (self._folder, self._tab):
                part.remove()
        self._generation, self._stops = session.generation, session.dragging.stops
        settings = session.env.settings
        self._world = World(
            self._server, frame, settings.scales.length_mm, float(settings.robot.edge_mm), self._dragged
        )
        self._folder = gui.add_tab_group()
        with self._folder.add_tab("Drive"):
            self._status = gui.add_html(status_html(frame.numbers, len(frame.contacts.points), self._ticks))
            self._add_driving()
        with self._folder.add_tab("Setting"):
            self._add_choices()
        self._tab = self._plots_panel.add_tab("Over time")
        with self._tab:
            self._plots = Plots(gui, len(frame.numbers.tensions))

    def _add_choices(self) -> None:
        choices = self._session.choices
        options = {
            "env_id": ("Task", tuple(ENV_IDS)),
            "robot": ("Robot", tuple(PRESETS)),
            "model": ("Model", MODELS),
            "sensing": ("Sensing", SENSINGS),
        }
        for name, (label, values) in options.items():
            dropdown = self._server.gui.add_dropdown(label, values, initial_value=getattr(choices, name))
            self._on(dropdown, lambda value, name=name: self._session.choose(name, value))

    def _add_driving(self) -> None:
        session, gui = self._session, self._server.gui
        choices = session.choices
        self._driver = gui.add_dropdown("Driver", drivers(choices.env_id), initial_value=choices.driver)
        self._on(self._driver, lambda value: session.choose("driver", value))
        low, high = (MILLI * bound for bound in session.force_range)
        self._desired = self._slider("Set-point [mN]", low, high, MILLI * session.desired)
        self._on(self._desired, lambda value: session.desire(value / MILLI))
        self._add_sliders()
        buttons = gui.add_button_group("Scene", ("New", "Straighten", "Pause"))
        self._on(buttons, lambda value: self._press(value))
        self._episodes = gui.add_checkbox("New scene after each episode", session.episodes)
        self._on(self._episodes, lambda value: setattr(session, "episodes", value))
        self._gif = gui.add_button("Record a GIF")
        self._gif.on_click(lambda _: self._inputs.put(self._toggle_recording))
        gui.add_markdown(
            "Drag obstacles by their handles. Keys: " + "; ".join(_key_hints(session.env.action_spec.size))
        )

    def _add_sliders(self) -> None:
        session, spec = self._session, self._session.env.action_spec
        self._cables = []
        for index, (low, high) in enumerate(zip(spec.low_mm.tolist(), spec.high_mm.tolist(), strict=True)):
            label = f"Cable {index + 1} [mm]" if index < spec.commands else "Length [mm]"
            slider = self._slider(label, low, high, float(session.targets_mm[index]))
            self._on(slider, lambda value, index=index: session.pull(index, value))
            self._cables.append(slider)
        for index, obstacle in enumerate(session.equilibrium.scene):
            if obstacle.size_fields:
                slider = self._slider(f"Size of obstacle {index + 1}", *RATIOS, session.dragging.ratios[index])
                self._on(slider, lambda value, index=index: session.resize(index, value))

    def _slider(self, label: str, low: float, high: float, value: float) -> viser.GuiSliderHandle[float]:
        step = 10.0 ** np.floor(np.log10((high - low) / 100))
        low, high = (float(np.round(bound / step) * step) for bound in (low, high))
        return self._server.gui.add_slider(label, low, high, float(step), float(np.clip(value, low, high)))

    def _on(self, handle: Any, act: Callable[[Any], None]) -> None:
        """Let the session act on what the user sets, not on what the page sets itself."""

        async def update(event: viser.GuiEvent[Any]) -> None:
            if event.client is not None:
                value = event.target.value
                self._inputs.put(lambda: act(value))

        (handle.on_click if isinstance(handle, viser.GuiButtonGroupHandle) else handle.on_update)(update)

    def _add_commands(self) -> None:
        for index, keys in enumerate(KEYS):
            for key, sign, verb in zip(keys, (1, -1), ("Pull", "Pay out"), strict=True):
                self._command(
                    f"{verb} {index + 1}", key, lambda index=index, sign=sign: self._session.nudge(index, sign * NUDGE)
                )
        self._command("New scene", "N", self._session.new_scene)
        self._command("Straighten", "T", self._session.straighten)
        self._command("Pause or go on", "space", lambda: self._press("Pause"))
        self._command("Record a GIF", "G", self._toggle_recording)

    def _command(self, label: str, key: Any, act: Callable[[], None]) -> None:
        command = self._server.gui.add_command(label, hotkey=key)

        @command.on_trigger
        async def _(_: object) -> None:
            self._inputs.put(act)

    def _press(self, button: str) -> None:
        if button == "New":
            self._session.new_scene()
        elif button == "Straighten":
            self._session.straighten()
        else:
            self._session.paused = not self._session.paused

    def _dragged(self, index: int, middle: np.ndarray) -> None:
        self._inputs.put(lambda: self._drag(index, middle))

    def _drag(self, index: int, middle: np.ndarray) -> None:
        session = self._session
        space, length = session.equilibrium.forces.shape[1], session.env.settings.scales.length_mm
        session.drag(index, to_robot(middle, length, space))

    def _follow(self, numbers: Numbers) -> None:
        """Let sliders show what a policy, a key or a new scene did."""
        session = self._session
        for slider, target, actual in zip(self._cables, session.targets_mm, numbers.actuated_mm, strict=True):
            _set(slider, float(target) if session.choices.driver == "Hand" else actual)
        _set(self._desired, MILLI * numbers.desired)
        if self._driver.value != session.choices.driver:
            self._driver.value = session.choices.driver
        if self._episodes.value != session.episodes:
            self._episodes.value = session.episodes

    def _toggle_recording(self) -> None:
        if self._recorder.path is None:
            self._recorder.start()
            self._gif.label = "Stop recording"
            return
        path = self._recorder.stop()
        self._gif.label = "Record a GIF"
        if path is not None:
            self._session.say(f"written: {path}")

    def _record(self) -> None:
        if self._recorder.path is not None and self._ticks % EVERY == 0:
            self._recorder.add(self._session.picture())
            if self._recorder.full:
                self._toggle_recording()


def _set(slider: viser.GuiSliderHandle[float], value: float) -> None:
    """Set a slider that the page is to move, unless it stands there already."""
    value = float(np.clip(value, slider.min, slider.max))
    if abs(slider.value - value) > slider.step / 2:
        slider.value = value


def _key_hints(size: int) -> list[str]:
    hints = [f"**{pull}** and **{pay}** pull and pay out {i + 1}" for i, (pull, pay) in enumerate(KEYS[:size])]
    return [*hints, "**N** new scene", "**T** straighten", "**space** pause", "**G** GIF"]


def status_html(numbers: Numbers, contacts: int, ticks: int) -> str:
    """Return the numbers of a step as HTML."""
    good = numbers.status in ("CONVERGED", "SNAPPED")
    tensions = " ".join(f"{tension:.2f}" for tension in numbers.tensions)
    rows = [
        ("status", f'<b style="color:{GOOD if good else BAD}">{numbers.status}</b>, step {numbers.step}'),
        ("contacts", f'<b style="color:{BAD if contacts else "inherit"}">{contacts}</b>'),
        ("desired force", f'{MILLI * numbers.desired:.1f} mN <b style="color:#703eb8">&#9632;</b>'),
        ("true force", f'<span id="ccr-true">{MILLI * numbers.true:.1f}</span> mN <b style="color:{GOOD}">&#9632;</b>'),
        ("estimated force", f'{MILLI * numbers.estimate:.1f} mN <b style="color:#f4921e">&#9632;</b>'),
        ("tension", f"{tensions} N"),
        ("residual", f"{numbers.residual:.1e}"),
        ("reward", f"{numbers.reward:.3f}"),
    ]
    cells = "".join(f"<tr><td style='padding-right:1em;opacity:.65'>{name}</td><td>{v}</td></tr>" for name, v in rows)
    return (
        f'<div id="ccr-status" data-tick="{ticks}" data-contacts="{contacts}" '
        'style="padding:.3em .8em;font-size:.82em;line-height:1.35">'
        f'<table>{cells}</table><div style="min-height:3.9em;color:{BAD}">{html.escape(numbers.message)}</div></div>'
    )
