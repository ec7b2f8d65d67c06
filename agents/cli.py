"""The ``ccr-gym`` command: what goes wrong outside it ends in one line; anything else is a bug and shows where."""

import sys
import threading

from agents.errors import UserError

INTERRUPTED, WRONG = 130, 2  # exit codes


def main() -> None:
    """Entry point."""
    before, threading.excepthook = threading.excepthook, _tell_bugs
    try:
        from agents.commands import run  # an interrupt may come while this loads

        run()
    except ModuleNotFoundError as error:
        if error.name != "tyro":
            raise
        sys.exit('the ccr-gym command needs its extra: pip install "ccr-gym[agents]"')
    except KeyboardInterrupt:
        _end("interrupted; train, retrain and sweep go on with the same command", INTERRUPTED)
    except UserError as error:
        _end(str(error), WRONG)
    except OSError as error:
        told = f"{error.filename}: {error.strerror}" if error.filename else str(error)
        _end(told, WRONG)
    finally:
        threading.excepthook = before


def _tell_bugs(caught: threading.ExceptHookArgs) -> None:
    """Say nothing of a log that cannot be written: its writer raises that again where it is called."""
    if not issubclass(caught.exc_type, OSError):
        threading.__excepthook__(caught)


def _end(line: str, code: int) -> None:
    print(f"ccr-gym: {line}", file=sys.stderr)
    sys.exit(code)


if __name__ == "__main__":
    main()
