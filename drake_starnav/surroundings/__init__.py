"""Scan -> star-shaped free space."""

from drake_starnav.surroundings.margins import Margins
from drake_starnav.surroundings.observation import Observation
from drake_starnav.surroundings.region_union import RegionUnion
from drake_starnav.surroundings.safe_region import CertifiedRegion
from drake_starnav.surroundings.star_region import StarRegion, scan_region, united

__all__ = [
    "Margins",
    "Observation",
    "RegionUnion",
    "CertifiedRegion",
    "StarRegion",
    "scan_region",
    "united",
]
