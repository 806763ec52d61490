"""Lidar navigation through unknown clutter, as Drake systems: star-shaped roadmap and modulation.

What is listed in `__all__`, here and of the packages that docs/api.md names, is the public interface: it changes only
with an entry in the changelog. All else is internal, whatever its name. A public name is imported when first used, so
that the numerics can be used without Drake.
"""

from drake_starnav.utils.compiled_ahead import use_compiled_functions
from drake_starnav.utils.imported import load_lazily

use_compiled_functions()

__version__ = "0.1.0"
__all__, __getattr__ = load_lazily(__name__, __file__)


def __dir__() -> list[str]:
    return sorted(__all__)
