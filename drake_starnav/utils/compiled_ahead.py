"""Functions that were compiled when the wheel was built, so that the first run of an installation need not wait.

A wheel for one Python and platform holds Numba's cache of its compiled functions, made for a processor of level
`LEVEL`, and a file `MARKER` that says so. Numba loads them where it would compile for the same processor. Where they do
not fit (another Numba, another processor, a setting of the user's) it compiles as it does without them.
"""

import os
import sys
from pathlib import Path

LEVEL = "x86-64-v3"
"""Processors since 2013 to 2015; measured, kernels compiled for it are as fast as those for the machine itself."""
FLAGS = frozenset(("avx2", "bmi1", "bmi2", "f16c", "fma", "abm", "movbe"))
"""What a processor of this level has, as Linux names it."""
SETTINGS = {"NUMBA_CPU_NAME": LEVEL, "NUMBA_CPU_FEATURES": ""}
MARKER = Path(__file__).resolve().parents[1] / "compiled_ahead"
PROCESSOR = Path("/proc/cpuinfo")


def use_compiled_functions(marker: Path = MARKER, processor: Path = PROCESSOR) -> bool:
    """Have Numba compile for the processor of the functions that came with the wheel, and thereby load them.

    Numba's own settings, in this process and in those that it starts; what the user has set stays. Call it before Numba
    is imported. Returns whether it does.

    Args:
        marker: file that a wheel with compiled functions contains.
        processor: the description of the processor that Linux gives.
    """
    if "numba" in sys.modules or not SETTINGS.keys().isdisjoint(os.environ) or not marker.is_file():
        return False
    if not _read_processor_flags(processor) >= FLAGS:
        return False
    os.environ.update(SETTINGS)
    return True


def _read_processor_flags(processor: Path) -> set[str]:
    try:
        processor_lines = processor.read_text(encoding="ascii", errors="replace").splitlines()
    except OSError:
        return set()
    return set(next((line for line in processor_lines if line.startswith("flags")), "").split())
