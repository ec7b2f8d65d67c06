"""Entry point of the ``ccr-gym`` command.

Whatever the user can correct is reported in one line; anything else is a bug and keeps its traceback.
"""

import importlib
import sys
import threading

from agents.errors import UserError

INTERRUPTED, FAILED = 130, 2  # exit codes
OWN_NAMES = {"solver": "Equilibrium", "agents": "LearnedPolicy"}  # a public name of each package


def main() -> None:
    """Run the command line and exit with its code."""
    before, threading.excepthook = threading.excepthook, _report_bugs
    try:
        check_packages()
        from agents.commands import run  # here, so that an interrupt while it loads is caught

        run()
    except ModuleNotFoundError as error:
        if error.name != "tyro":
            raise
        _exit('the ccr-gym command needs its extra: pip install "ccr-gym[agents]"', FAILED)
    except KeyboardInterrupt:
        _exit("interrupted; run the same command again to resume train, retrain or sweep", INTERRUPTED)
    except UserError as error:
        _exit(str(error), FAILED)
    except OSError as error:
        _exit(f"{error.filename}: {error.strerror}" if error.filename else str(error), FAILED)
    finally:
        threading.excepthook = before


def check_packages() -> None:
    """Refuse to run with another project's ``solver`` or ``agents`` package in the place of ours.

    Raises:
        UserError: Naming the package, its path and the remedy.
    """
    for package, name in OWN_NAMES.items():
        found = importlib.import_module(package)
        if name not in getattr(found, "__all__", ()):
            raise UserError(
                f"the package {package!r} in {found.__file__} is another project's of that name; install ccr-gym in a "
                "virtual environment of its own, or reinstall it: pip install --force-reinstall --no-deps ccr-gym"
            )


def _report_bugs(caught: threading.ExceptHookArgs) -> None:
    """Print the traceback of a thread, except for a log that cannot be written: its writer raises that again."""
    if not issubclass(caught.exc_type, OSError):
        threading.__excepthook__(caught)


def _exit(line: str, code: int) -> None:
    print(f"ccr-gym: {line}", file=sys.stderr)
    sys.exit(code)


if __name__ == "__main__":
    main()
