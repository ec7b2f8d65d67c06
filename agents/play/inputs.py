"""What users do on the page, kept until the session is between two ticks."""

from collections.abc import Callable
from queue import SimpleQueue
from typing import Literal, TypeVar

import viser

T = TypeVar("T")
Key = Literal["G", "H", "J", "K", "L", "N", "O", "P", "T", "U", "Y", "space"]


class Inputs:
    """Queue between the thread of the server, which hears what users do, and that of the session, which acts on it."""

    def __init__(self) -> None:
        self._queue: SimpleQueue[Callable[[], object]] = SimpleQueue()

    def put(self, act: Callable[[], object]) -> None:
        """Have something done before the next tick."""
        self._queue.put(act)

    def run(self) -> None:
        """Do all that was put."""
        while not self._queue.empty():
            self._queue.get()()

    def on_value(self, handle: viser.GuiInputHandle[T], act: Callable[[T], object]) -> None:
        """Act on the values that users set, not on those that the page sets itself."""

        async def update(event: viser.GuiEvent[viser.GuiInputHandle[T]]) -> None:
            if event.client is not None:
                value = event.target.value
                self.put(lambda: act(value))

        handle.on_update(update)

    def on_choice(self, handle: viser.GuiButtonGroupHandle, act: Callable[[str], object]) -> None:
        """Act on the button of a group that a user presses."""

        async def click(event: viser.GuiEvent[viser.GuiButtonGroupHandle]) -> None:
            value = event.target.value
            self.put(lambda: act(value))

        handle.on_click(click)

    def on_click(self, handle: viser.GuiButtonHandle, act: Callable[[], object]) -> None:
        """Act on a button."""

        async def click(_: viser.GuiEvent[viser.GuiButtonHandle]) -> None:
            self.put(act)

        handle.on_click(click)

    def on_key(self, gui: viser.GuiApi, label: str, key: Key, act: Callable[[], object]) -> None:
        """Act on a key, and list it in the page's palette of commands."""

        async def trigger(_: viser.CommandEvent) -> None:
            self.put(act)

        gui.add_command(label, hotkey=key).on_trigger(trigger)


def set_value(handle: viser.GuiInputHandle[T], value: T) -> None:
    """Set a value on the page unless it stands there already."""
    if handle.value != value:
        handle.value = value  # type: ignore[misc]  # viser defines this setter apart from its getter, which mypy misses
