"""What keeps a standing robot from driving is named: where it is blind, what is too near, and by which margin."""

import math
import re

import numpy as np
import pytest

from drake_starnav.geometry.footprint import Footprint, disc, footprint
from drake_starnav.lidar.laser_scan import DYNAMIC, LaserScan
from drake_starnav.surroundings.surroundings import Surroundings
from drake_starnav.systems.obstruction import describe_obstruction
from tests.helpers.scans import RADIUS, observe_scan

MARGIN, REACH = 0.0145, 1.2
DISC = disc(RADIUS)
AHEAD, BEHIND = 0.0, math.radians(130.0)


def said(scan: LaserScan, towards: float = AHEAD, yaw: float = 2.0, shape: Footprint = DISC) -> str:
    """Why a robot that took a scan anywhere does not drive towards a bearing."""
    pose = np.array((3.0, -1.0, yaw))
    surroundings = observe_scan(scan, pose, shape.cover_radius + MARGIN, REACH, shape=shape)
    return describe_obstruction(surroundings, scan, towards, shape, pose)


def seen(ranges: dict[int, float], **changes) -> LaserScan:
    """A scan of 360 beams with given ranges at some bearings in whole degrees; the others end nowhere."""
    found = np.full(360, math.inf)
    for degrees, value in ranges.items():
        found[(degrees + 180) % 360] = value
    usual = {"angle_min": -math.pi, "angle_increment": math.radians(1.0), "range_min": 0.1}
    return LaserScan(**{**usual, "time": 0.0, "range_max": 5.0, "ranges": found, "lost_beams": True, **changes})


def test_nothing_obstructs_where_there_is_room() -> None:
    assert said(seen({})) == said(seen({0: 0.4})) == said(seen({120: 0.25})) == ""


@pytest.mark.parametrize(("degrees", "side"), [(0, "0 degrees to the"), (-30, "30 degrees to the right")])
def test_what_is_too_near_is_named_with_the_margin(degrees: int, side: str) -> None:
    reason = said(seen({degrees: 0.26, 170: 0.2}))
    assert reason.startswith(f"too near: a hit of beam {180 + degrees} at 0.260 m, {side}")
    assert reason.endswith("robot.radius 0.25 m with a safety margin of 0.0145 m keeps 0.265 m from it")


def test_what_is_too_near_to_a_polygon_is_measured_from_its_outline() -> None:
    """Also where the disc within it has room."""
    shape = footprint(((0.4, -0.2), (0.4, 0.2), (-0.4, 0.2), (-0.4, -0.2)))
    assert said(seen({180 - 26: 0.48, 0: 0.6}), shape=shape).startswith(
        "too near: a hit 0.033 m from the footprint, 154"
    )
    assert said(seen({0: 0.5, 90: 0.3}), shape=shape) == ""
    assert said(seen({}), shape=shape) == ""
    free = np.full(360, 5.0)
    free[60 + 180] = 0.25  # nearer than the hit, but nothing was measured there
    scan = seen({60: math.nan, 90: 0.235}, free=free)
    assert said(scan, shape=shape).startswith("too near: a hit 0.035 m from the footprint, 90")


def test_a_hit_that_is_too_close_to_be_measured_has_no_distance() -> None:
    assert said(seen(dict.fromkeys((5, 6, 7), -math.inf))).startswith(
        "too near: a hit of beam 185 nearer than lidar.range_min 0.1 m, 5 deg"
    )


def test_a_direction_that_the_lidar_does_not_see_is_named() -> None:
    scan = LaserScan(0.0, -2.0, 4.0 / 300, 0.1, 5.0, np.full(301, math.inf))
    assert said(scan) == ""
    reason = said(scan, BEHIND)
    assert re.search(r"^blind: the lidar looks from -115 to 115 degrees; the way leads towards 130 deg", reason)


def test_lost_beams_make_blind() -> None:
    reason = said(seen({degrees: math.nan for degrees in range(-180, 180) if degrees % 60}))
    assert reason.startswith("blind: 354 of 360 beams are lost")


def test_what_moves_is_named_too() -> None:
    motion = np.zeros(360, np.int8)
    motion[185] = DYNAMIC
    assert said(seen({5: 0.6}, motion=motion)) == "too near: an obstacle that moves, at 0.60 m, 5 degrees to the left"


def test_without_scans_no_hit_is_to_blame() -> None:
    assert describe_obstruction(Surroundings.unknown(), LaserScan.nothing(), AHEAD, DISC, np.zeros(3)) == ""
