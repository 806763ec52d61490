"""Scans -> dynamic obstacles."""

import drake_starnav.utils.compilation  # noqa: F401  (shows what is compiled)
