"""Entry point of the ``ccr-gym`` command.

Whatever the user can correct is reported in one line; anything else is a bug and keeps its traceback.
"""

import signal
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from importlib import import_module

from agents.errors import UserError

INTERRUPTED, FAILED = 130, 2  # exit codes
PACKAGES = {"solver", "solver._kernel", "agents"}  # that another project may have put in the place of ours


def main() -> None:
    """Run the command line and exit with its code."""
    before, threading.excepthook = threading.excepthook, _report_bugs
    try:
        with _interrupts_held():
            import_module("ccr_gym").check_packages()
            from agents.commands import run  # here, so that an interrupt while it loads is caught

        run()
    except ImportError as error:
        if error.name == "tyro":
            _exit('the ccr-gym command needs its extra: pip install "ccr-gym[agents]"', FAILED)
        if error.name not in PACKAGES:
            raise
        _exit(str(error), FAILED)
    except KeyboardInterrupt:
        _exit("interrupted; run the same command again to resume train, retrain or sweep", INTERRUPTED)
    except UserError as error:
        _exit(str(error), FAILED)
    except OSError as error:
        _exit(f"{error.filename}: {error.strerror}" if error.filename else str(error), FAILED)
    finally:
        threading.excepthook = before


@contextmanager
def _interrupts_held() -> Iterator[None]:
    """Keep an interrupt until the end of the block: packages may swallow one while they load."""
    signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_UNBLOCK, {signal.SIGINT})


def _report_bugs(caught: threading.ExceptHookArgs) -> None:
    """Print the traceback of a thread, except for a log that cannot be written: its writer raises that again."""
    if not issubclass(caught.exc_type, OSError):
        threading.__excepthook__(caught)


def _exit(line: str, code: int) -> None:
    print(f"ccr-gym: {line}", file=sys.stderr)
    sys.exit(code)


if __name__ == "__main__":
    main()
