"""What the user of a command can mend."""


class UserError(ValueError):
    """Shown by the ``ccr-gym`` command as one line without a traceback: says what is wrong and what to do."""
