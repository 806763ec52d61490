"""Scan -> star-shaped free space."""

import drake_starnav.utils.compilation  # noqa: F401  (shows what is compiled)
from drake_starnav.regions.margins import Margins
from drake_starnav.regions.observation import Observation
from drake_starnav.regions.star_region import RegionStack, StarRegion, scan_region

__all__ = [
    "Margins",
    "Observation",
    "RegionStack",
    "StarRegion",
    "scan_region",
]
