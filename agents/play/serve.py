"""The command: a server on this machine alone, and the loop that moves the session."""

import time
import webbrowser

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
    server = viser.ViserServer(HOST, config.port, verbose=False)
    url = f"http://{HOST}:{server.get_port()}"
    try:
        page = Page(server, session, recorder)
        print(f"Playing {choices.env_id} at {url}; Ctrl-C ends it", flush=True)
        if config.open:
            webbrowser.open(url)
        run(page)
    except KeyboardInterrupt:
        print("\nPlay has ended", flush=True)
    finally:
        recorder.stop()
        server.stop()
        session.close()


def run(page: Page) -> None:
    """Update the page at its rate, for ever; after a slow update it catches up what it is late by, up to a bound."""
    due = time.perf_counter()
    while True:
        page.tick()
        due = max(due + 1 / RATE, time.perf_counter() - LATEST)
        time.sleep(max(0.0, due - time.perf_counter()))
