"""Refusals at the boundary."""


def require(condition: bool, message: str) -> None:
    """Refuse what does not meet a condition.

    Raises:
        ValueError: With the message.
    """
    if not condition:
        raise ValueError(message)
