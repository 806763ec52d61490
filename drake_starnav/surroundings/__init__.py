"""Scan -> star-shaped free space."""

from drake_starnav.surroundings.margins import Margins
from drake_starnav.surroundings.observation import Observation
from drake_starnav.surroundings.region_union import RegionUnion
from drake_starnav.surroundings.star_region import StarRegion, make_scan_region, unite_regions
from drake_starnav.surroundings.surroundings import Surroundings, observe
from drake_starnav.surroundings.view import View, make_view

__all__ = [
    "Margins",
    "Observation",
    "RegionUnion",
    "StarRegion",
    "Surroundings",
    "View",
    "make_view",
    "observe",
    "make_scan_region",
    "unite_regions",
]
