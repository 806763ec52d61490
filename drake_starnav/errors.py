"""The one base class of every error that this package raises on purpose, and what callers tell apart."""


class StarnavError(Exception):
    """Bad input: the message names the place, the value found, and what is allowed."""


class UnsupportedError(StarnavError):
    """A method that cannot be tried in a world at all, which is no failure of a trial."""
