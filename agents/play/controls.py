"""The controls of one environment: who drives, set-point, cables, sizes of obstacles, buttons."""

from collections.abc import Callable
from typing import TypeAlias

import numpy as np
import viser

from agents.play.choices import drivers
from agents.play.dragging import RATIOS
from agents.play.frame import Numbers
from agents.play.inputs import Inputs, Key, set_value
from agents.play.session import Session

KEYS: tuple[tuple[Key, Key], ...] = (("K", "J"), ("L", "H"), ("O", "U"), ("P", "Y"))  # pull and pay out a coordinate
ARROWS = "Arrows: the force of the robot on the obstacle, **green** the true one, **orange** its estimate."
RECORD, STOP_RECORDING = "Record a GIF", "Stop recording"
MILLI = 1e3
MOST_SLIDERS = 1000  # of cables and obstacles, all of which are between the set-point and the buttons

Slider: TypeAlias = viser.GuiSliderHandle[float]


class Controls:
    """Controls in the part of the page that is open, which are fitted to each environment.

    None is ever removed: a browser that is late applies removals before the updates that were sent ahead of them, and
    reports each as an error. What an environment has no use for is hidden.

    Args:
        gui: Where they are added.
        session: What they control.
        inputs: What users do goes there.
        record: Called when a user presses the button of recordings.
    """

    def __init__(self, gui: viser.GuiApi, session: Session, inputs: Inputs, record: Callable[[], None]) -> None:
        self._gui, self._session, self._inputs = gui, session, inputs
        self._driver = gui.add_dropdown("Driver", drivers(session.choices.env_id), initial_value=session.choices.driver)
        self._desired = self._add_slider(lambda value: session.desire(value / MILLI))
        self._cables: list[Slider] = []
        self._sizes: list[Slider] = []
        self._buttons = gui.add_button_group("Scene", ("New", "Straighten", "Pause"))
        self._episodes = gui.add_checkbox("New scene after each episode", session.episodes)
        self._gif = gui.add_button("")
        self._hints = gui.add_markdown("")
        self.show_recording(False)
        self.fit()
        inputs.on_value(self._driver, lambda value: session.choose("driver", value))
        inputs.on_choice(self._buttons, self._press)
        inputs.on_value(self._episodes, lambda value: setattr(session, "episodes", value))
        inputs.on_click(self._gif, record)

    def fit(self) -> None:
        """Fit them to the session's environment, in the part of the page where they were added."""
        session, spec = self._session, self._session.env.action_spec
        self._driver.options = drivers(session.choices.env_id)
        _set_range(self._desired, "Set-point [mN]", *(MILLI * bound for bound in session.force_range))
        for index in range(len(self._cables), spec.size):
            self._cables.append(self._add_cable(index))
        for index, slider in enumerate(self._cables):
            slider.visible = index < spec.size
            if slider.visible:
                label = f"Cable {index + 1} [mm]" if index < spec.commands else "Length [mm]"
                _set_range(slider, label, float(spec.low_mm[index]), float(spec.high_mm[index]))
        have_size = [bool(obstacle.size_fields) for obstacle in session.equilibrium.scene]
        for index in range(len(self._sizes), len(have_size)):
            self._sizes.append(self._add_size(index))
        for index, slider in enumerate(self._sizes):
            slider.visible = index < len(have_size) and have_size[index]
        self._hints.content = f"{ARROWS} Drag obstacles by their handles. Keys: {'; '.join(self._key_hints())}"

    def follow(self, numbers: Numbers) -> None:
        """Show what a policy, a key or a new scene did."""
        session = self._session
        by_hand = session.choices.driver == "Hand"
        places = session.targets_mm.tolist() if by_hand else numbers.actuated_mm
        for slider, place in zip(self._cables, places, strict=False):  # the others are hidden
            _slide(slider, place)
        _slide(self._desired, MILLI * numbers.desired)
        for slider, ratio in zip(self._sizes, session.dragging.ratios, strict=False):
            _slide(slider, ratio)
        set_value(self._driver, session.choices.driver)
        set_value(self._episodes, session.episodes)

    def show_recording(self, recording: bool) -> None:
        """Show whether a recording is under way."""
        self._gif.label = STOP_RECORDING if recording else RECORD
        self._gif.color = "red" if recording else None

    def _add_cable(self, index: int) -> Slider:
        return self._add_slider(lambda value: self._session.pull(index, value), (1 + index) / MOST_SLIDERS)

    def _add_size(self, index: int) -> Slider:
        slider = self._add_slider(lambda value: self._session.resize(index, value), 0.5 + (1 + index) / MOST_SLIDERS)
        _set_range(slider, f"Size of obstacle {index + 1}", *RATIOS)
        return slider

    def _add_slider(self, act: Callable[[float], object], after: float | None = None) -> Slider:
        """Add a slider at the end, or after the set-point and before what was added next."""
        order = None if after is None else self._desired.order + after
        slider = self._gui.add_slider("", 0.0, 1.0, 0.1, 0.0, order=order)
        self._inputs.on_value(slider, act)
        return slider

    def _press(self, button: str) -> None:
        session = self._session
        actions = {"New": session.new_scene, "Straighten": session.straighten, "Pause": session.pause}
        actions[button]()

    def _key_hints(self) -> list[str]:
        keys = enumerate(KEYS[: self._session.env.action_spec.size])
        hints = [f"**{pull}** and **{pay}** pull and pay out {index + 1}" for index, (pull, pay) in keys]
        return [*hints, "**N** new scene", "**T** straighten", "**space** pause", "**G** GIF"]


def _set_range(slider: Slider, label: str, low: float, high: float) -> None:
    decade = int(np.floor(np.log10((high - low) / 100)))
    step = float(10.0**decade)
    slider.label, slider.step, slider.precision = label, step, max(0, -decade)
    slider.min, slider.max = _rounded(low, step), _rounded(high, step)
    _slide(slider, slider.value)


def _slide(slider: Slider, value: float) -> None:
    set_value(slider, float(np.clip(_rounded(value, slider.step), slider.min, slider.max)))


def _rounded(value: float, step: float) -> float:
    """Return the nearest multiple of a step, with no more decimals than the step."""
    return round(round(value / step) * step, 9)
