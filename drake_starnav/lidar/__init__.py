"""A scan, and what a sensor makes of the world."""

import drake_starnav.utils.compilation  # noqa: F401  (shows what is compiled)
