"""The controls of one environment: who drives, set-point, cables, sizes of obstacles, buttons."""

from collections.abc import Callable

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


class Controls:
    """Controls in the part of the page that is open; another environment has controls of its own.

    Args:
        gui: Where they are added.
        session: What they control.
        inputs: What users do goes there.
        record: Called when a user presses the button of recordings.
        recording: Whether a recording is under way.
    """

    def __init__(
        self, gui: viser.GuiApi, session: Session, inputs: Inputs, record: Callable[[], None], recording: bool
    ) -> None:
        self._gui, self._session, self._inputs = gui, session, inputs
        self._driver = gui.add_dropdown("Driver", drivers(session.choices.env_id), initial_value=session.choices.driver)
        self._desired = self._add_desired()
        self._cables = self._add_cables()
        self._sizes = self._add_sizes()
        self._buttons = gui.add_button_group("Scene", ("New", "Straighten", "Pause"))
        self._episodes = gui.add_checkbox("New scene after each episode", session.episodes)
        self._gif = gui.add_button("")
        self._hints = gui.add_markdown(
            f"{ARROWS} Drag obstacles by their handles. Keys: {'; '.join(self._key_hints())}"
        )
        self.show_recording(recording)
        inputs.on_value(self._driver, lambda value: session.choose("driver", value))
        inputs.on_choice(self._buttons, self._press)
        inputs.on_value(self._episodes, lambda value: setattr(session, "episodes", value))
        inputs.on_click(self._gif, record)

    def follow(self, numbers: Numbers) -> None:
        """Show what a policy, a key or a new scene did."""
        session = self._session
        by_hand = session.choices.driver == "Hand"
        places = session.targets_mm.tolist() if by_hand else numbers.actuated_mm
        for slider, place in zip((*self._cables, self._desired), (*places, MILLI * numbers.desired), strict=True):
            _slide(slider, place)
        for index, slider in self._sizes.items():
            _slide(slider, session.dragging.ratios[index])
        set_value(self._driver, session.choices.driver)
        set_value(self._episodes, session.episodes)

    def show_recording(self, recording: bool) -> None:
        """Show whether a recording is under way."""
        self._gif.label = STOP_RECORDING if recording else RECORD
        self._gif.color = "red" if recording else None

    def remove(self) -> None:
        """Remove all of them."""
        for slider in (self._desired, *self._cables, *self._sizes.values()):
            slider.remove()
        for part in (self._driver.remove, self._buttons.remove, self._episodes.remove, self._gif.remove):
            part()
        self._hints.remove()

    def _add_desired(self) -> viser.GuiSliderHandle[float]:
        session = self._session
        low, high = (MILLI * bound for bound in session.force_range)
        slider = self._add_slider("Set-point [mN]", low, high, MILLI * session.desired)
        self._inputs.on_value(slider, lambda value: session.desire(value / MILLI))
        return slider

    def _add_cables(self) -> list[viser.GuiSliderHandle[float]]:
        spec = self._session.env.action_spec
        return [self._add_cable(index) for index in range(spec.size)]

    def _add_cable(self, index: int) -> viser.GuiSliderHandle[float]:
        session, spec = self._session, self._session.env.action_spec
        label = f"Cable {index + 1} [mm]" if index < spec.commands else "Length [mm]"
        low, high, target = (float(array[index]) for array in (spec.low_mm, spec.high_mm, session.targets_mm))
        slider = self._add_slider(label, low, high, target)
        self._inputs.on_value(slider, lambda value: session.pull(index, value))
        return slider

    def _add_sizes(self) -> dict[int, viser.GuiSliderHandle[float]]:
        scene = self._session.equilibrium.scene
        return {index: self._add_size(index) for index, obstacle in enumerate(scene) if obstacle.size_fields}

    def _add_size(self, index: int) -> viser.GuiSliderHandle[float]:
        session = self._session
        slider = self._add_slider(f"Size of obstacle {index + 1}", *RATIOS, session.dragging.ratios[index])
        self._inputs.on_value(slider, lambda value: session.resize(index, value))
        return slider

    def _add_slider(self, label: str, low: float, high: float, value: float) -> viser.GuiSliderHandle[float]:
        step = float(10.0 ** np.floor(np.log10((high - low) / 100)))
        low, high = (_rounded(bound, step) for bound in (low, high))
        return self._gui.add_slider(label, low, high, step, float(np.clip(_rounded(value, step), low, high)))

    def _press(self, button: str) -> None:
        session = self._session
        actions = {"New": session.new_scene, "Straighten": session.straighten, "Pause": session.pause}
        actions[button]()

    def _key_hints(self) -> list[str]:
        keys = enumerate(KEYS[: self._session.env.action_spec.size])
        hints = [f"**{pull}** and **{pay}** pull and pay out {index + 1}" for index, (pull, pay) in keys]
        return [*hints, "**N** new scene", "**T** straighten", "**space** pause", "**G** GIF"]


def _slide(slider: viser.GuiSliderHandle[float], value: float) -> None:
    set_value(slider, float(np.clip(_rounded(value, slider.step), slider.min, slider.max)))


def _rounded(value: float, step: float) -> float:
    """Return the nearest multiple of a step, with no more decimals than the step."""
    return round(round(value / step) * step, 9)
