"""Scan -> star-shaped free region."""

from drake_starnav.stars.parameters import StarParameters
from drake_starnav.stars.region import RegionStack, StarRegion, scan_region

__all__ = ["RegionStack", "StarParameters", "StarRegion", "scan_region"]
