"""Areas that only the planner's map closes."""

import numpy as np
import pytest

from drake_starnav.planning import PlannerParameters, PlannerState
from drake_starnav.planning.closed_areas import SPACING, closed_area, closing, kept_clear, mapped
from drake_starnav.surroundings.observation import Observation
from drake_starnav.surroundings.star_region import scan_region
from drake_starnav.worlds.world import World
from tests.helpers.scans import MARGINS, RADIUS, cast

SQUARE = np.array([(1.0, -0.5), (2.0, -0.5), (2.0, 0.5), (1.0, 0.5)])
START, GOAL = np.zeros(2), np.array((4.0, 0.0))
STATE = PlannerState.initial(PlannerParameters(), RADIUS)


def corridor(name: str, x: float, width: float):
    """An area across the x axis."""
    low, high = -0.5 * width, 0.5 * width
    return closed_area(name, np.array(((x, low), (x + 0.5, low), (x + 0.5, high), (x, high))), 0.02, RADIUS)


def test_the_border_goes_all_around_without_a_gap() -> None:
    border = closed_area("dock", SQUARE, 0.02, RADIUS).border
    steps = np.hypot(*np.diff(np.vstack((border, border[:1])), axis=0).T)
    assert steps.max() <= SPACING * RADIUS + 1e-9
    assert all((np.hypot(*(border - corner).T) < 1e-9).any() for corner in SQUARE)


def test_the_map_has_every_border_whatever_it_had_before() -> None:
    areas = [corridor("a", 1.0, 1.0), corridor("b", 1.5, 1.0)]  # they share a side
    state = mapped(STATE, areas)
    assert max(state.roadmap.hits.distance(area.border).max() for area in areas) <= state.roadmap.hits.resolution
    assert mapped(state, areas) is state
    assert mapped(STATE, ()) is STATE


def test_a_region_keeps_its_distance_and_one_who_is_too_near_may_leave() -> None:
    scan = cast(World("empty", (0.0, 0.0, 0.0), (4.0, 0.0)), np.zeros(3))
    seen = Observation(scan_region(scan, np.zeros(3), RADIUS, MARGINS), scan, np.zeros(3))
    area = closed_area("dock", SQUARE, 0.1, RADIUS)
    region = kept_clear(seen, [area], RADIUS).region
    reach = 1.0 - RADIUS - 0.1
    assert region.alone.contains(np.array([(reach - 0.03, 0.0), (-2.0, 0.0)]), 0.0).all()
    assert not region.alone.contains(np.array([(reach + 0.03, 0.0)]), 0.0).any()
    beside = closed_area("near", SQUARE - (0.7, 0.0), 0.1, RADIUS)
    assert kept_clear(seen, [beside], RADIUS).region.alone.contains(np.array([(-2.0, 0.0)]), 0.0).all()


@pytest.mark.parametrize(
    ("areas", "name"),
    [
        ([closed_area("bay", SQUARE + (2.5, 0.0), 0.02, RADIUS)], "bay"),
        ([corridor("beside", 1.0, 1.0), closed_area("bay", SQUARE + (2.5, 0.0), 0.02, RADIUS)], "bay"),
        ([], ""),
    ],
)
def test_the_area_that_closes_the_way_is_named(areas: list, name: str) -> None:
    assert closing(STATE, areas, np.vstack((START, GOAL)), MARGINS, RADIUS) == name
