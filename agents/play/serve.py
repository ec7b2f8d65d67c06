"""The command: a server on this machine alone, and the loop that moves the session."""

import signal
import sys
import time
import webbrowser
from collections.abc import Iterator
from contextlib import contextmanager
from threading import Event

import rich
import viser

from agents.config import PlayConfig
from agents.errors import UserError
from agents.play.choices import Choices
from agents.play.page import Page
from agents.play.recorder import Recorder
from agents.play.session import Session

HOST = "127.0.0.1"
RATE = 40.0  # updates a second
LATEST = 0.2  # that updates may be late by and are caught up with [s]


def play(config: PlayConfig) -> None:
    """Serve the page until Ctrl-C.

    Raises:
        UserError: If a name in the configuration is unknown.
    """
    try:
        choices = Choices(robot=config.robot).changed("env_id", config.env_id)
    except ValueError as error:
        raise UserError(str(error)) from error
    session, recorder = Session(choices), Recorder(config.out)
    with _server(config.port) as server, _interrupt() as interrupted:
        page, url = Page(server, session, recorder), f"http://{HOST}:{server.get_port()}"
        print(f"Playing {choices.env_id} at {url}; Ctrl-C ends it", flush=True)
        if config.open:
            webbrowser.open(url)
        run(page, interrupted)
        recorder.stop()
    session.close()
    print("\nPlay has ended" if sys.stdout.isatty() else "Play has ended", flush=True)


def run(page: Page, ended: Event) -> None:
    """Update the page at its rate until the end, and catch up after a slow update what it is late by, up to a bound."""
    due = time.perf_counter()
    while not ended.is_set():
        page.tick()
        due = max(due + 1 / RATE, time.perf_counter() - LATEST)
        time.sleep(max(0.0, due - time.perf_counter()))


@contextmanager
def _server(port: int) -> Iterator[viser.ViserServer]:
    """Yield a server that prints neither its banner nor its end."""
    with _rich_is_quiet():
        server = viser.ViserServer(HOST, port, verbose=False)
    try:
        yield server
    finally:
        with _rich_is_quiet():
            server.stop()


@contextmanager
def _rich_is_quiet() -> Iterator[None]:
    """Let the console that viser prints to, which is Rich's global one, print nothing."""
    console = rich.get_console()
    before, console.quiet = console.quiet, True
    try:
        yield
    finally:
        console.quiet = before


@contextmanager
def _interrupt() -> Iterator[Event]:
    """Yield what Ctrl-C sets instead of raising, which CasADi may swallow; a second one raises."""
    interrupted = Event()

    def note(*_: object) -> None:
        signal.signal(signal.SIGINT, before)
        interrupted.set()

    before = signal.signal(signal.SIGINT, note)
    try:
        yield interrupted
    finally:
        signal.signal(signal.SIGINT, before)
