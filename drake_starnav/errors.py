"""The one base class of every error that this package raises on purpose."""


class StarnavError(Exception):
    """Bad input: the message names the place, the value found, and what is allowed."""
