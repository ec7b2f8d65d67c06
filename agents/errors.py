"""Errors that the user of a command can correct."""


class UserError(ValueError):
    """Reported by the ``ccr-gym`` command in one line without a traceback: what is wrong, and the remedy."""
