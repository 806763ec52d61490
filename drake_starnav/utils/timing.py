"""When systems are updated."""

import math

from drake_starnav.errors import StarnavError

EARLY = 1e-6
"""By rounding, a scan's time may be this far in the future, s."""


def check_period(system: object, *, period: float | None = None, rate: float | None = None) -> float:
    """The period of a system's updates, s, of a period in s or a rate in Hz; the system is named in messages.

    Raises:
        StarnavError: Drake would end the process with this period, or never update the system.
    """
    name, value = ("period", period) if rate is None else ("rate", rate)
    if value is None or not (math.isfinite(value) and value > 0.0):
        raise StarnavError(f"{type(system).__name__}: {name} is {value}; allowed: 0 < x, finite")
    return value if rate is None else 1.0 / value


def is_new_run(time: float, last: float) -> bool:
    """Whether an initialization event at a time begins a run, or finds one under way, as in the clone of a context.

    `last`: when the system was initialized or updated last, s; NaN for never. Time that was set back begins a run.
    """
    return not last < time
