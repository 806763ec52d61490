"""Closures: what they take from regions, and which walls last."""

import dataclasses

import numpy as np
import pytest
import shapely

from drake_starnav.planning import PlannerInput, PlannerParameters, PlannerState
from drake_starnav.planning.closures import add_latest_node, close_path, find_blocking_keep_outs, reopen_closures
from drake_starnav.planning.roadmap import (
    CLOSURE_RADIUS,
    KEEP_OUT_SPACING,
    NOTHING_CLOSED,
    ClosedPlaces,
    replace_regions,
)
from drake_starnav.worlds.world import World
from tests.helpers.scans import MARGINS, RADIUS, cast, planner_input

SQUARE = np.array([(1.0, -0.5), (2.0, -0.5), (2.0, 0.5), (1.0, 0.5)])
BRACKET = np.array([(2.5, 0.0), (2.5, 1.5), (5.5, 1.5), (5.5, 0.0), (5.2, 0.0), (5.2, 1.2), (2.8, 1.2), (2.8, 0.0)])
GOAL = np.array((4.0, 0.0))
PARAMETERS = PlannerParameters()


def keep_outs(*areas: tuple[str, np.ndarray], distance: float = 0.0) -> ClosedPlaces:
    """The walls around polygons (n, 2), at a distance, m."""
    closures = NOTHING_CLOSED
    for name, polygon in areas:
        closures = closures.add_keep_out(polygon, distance, name, RADIUS)
    return closures


def begun(walls: ClosedPlaces) -> tuple[PlannerState, PlannerInput]:
    """A state with a node in the open, and its input."""
    now = planner_input(cast(World("empty", (0.0, 0.0, 0.0), (4.0, 0.0))), np.zeros(3), GOAL)
    return add_latest_node(PlannerState.initial(PARAMETERS, RADIUS, closures=walls), now), now


@pytest.mark.parametrize("distance", [0.0, 0.1])
def test_a_wall_goes_all_around_at_its_distance_without_a_gap(distance: float) -> None:
    wall, square = keep_outs(("dock", SQUARE), distance=distance).all_keep_outs, shapely.Polygon(SQUARE)
    away = shapely.distance(square.exterior, shapely.points(wall))
    np.testing.assert_allclose(away, distance, atol=0.01 * distance + 1e-9)
    around = square.buffer(distance).exterior
    nearest = shapely.distance(
        shapely.MultiPoint(wall), shapely.points(shapely.get_coordinates(around.segmentize(0.01)))
    )
    assert nearest.max() <= 0.5 * KEEP_OUT_SPACING * RADIUS + 1e-9


def test_a_region_keeps_off_walls_and_who_is_on_one_may_leave() -> None:
    _, now = begun(NOTHING_CLOSED)
    region, distance = now.observation.region, 0.1
    open_part = keep_outs(("dock", SQUARE), distance=distance).open_part(region)
    reach = 1.0 - distance - RADIUS - region.margin
    assert open_part.contains(np.array([(reach - 0.03, 0.0), (-2.0, 0.0)])).all()
    assert not open_part.contains(np.array([(reach + 0.03, 0.0)])).any()
    for far in (0.05, RADIUS + 0.5 * region.margin):  # on it, and a little too near
        beside = keep_outs(("near", SQUARE - (1.0 - far, 0.0))).open_part(region)
        assert beside.contains(np.array([(-2.0, 0.0)])).all()
    assert not beside.contains(np.array([(0.1, 0.0)])).any()


def test_walls_last_whatever_is_made_anew_and_failed_ways_do_not() -> None:
    walls = keep_outs(("dock", SQUARE), ("bay", SQUARE + (0.0, 1.0)))  # they share a side
    state, now = begun(walls)
    after = close_path(state, np.array(((-1.0, 0.0),)), now)
    assert len(after.roadmap.closures.failed_places) == 1 and list(after.roadmap.closures.keep_out_points) == [
        "dock",
        "bay",
    ]
    forgetful = dataclasses.replace(MARGINS, drop_seen_through=True)
    regions = [dataclasses.replace(region) for region in after.roadmap.regions]
    again = {
        "reopened": reopen_closures(after, now).roadmap,
        "revised": replace_regions(after.roadmap, regions, forgetful, RADIUS),
        "emptied": replace_regions(after.roadmap, [None], forgetful, RADIUS),
    }
    for how, roadmap in again.items():
        kept = roadmap.closures
        assert list(kept.keep_out_points) == list(walls.keep_out_points) and len(kept.failed_places) == (
            how in ("revised", "emptied")
        ), how
        assert roadmap.grid.distance(kept.all_keep_outs).max() <= roadmap.grid.resolution, how
        assert not roadmap.union.contains(SQUARE - (0.8 * CLOSURE_RADIUS * RADIUS, 0.0)).any(), how


@pytest.mark.parametrize(
    ("areas", "name"),
    [
        ([("bay", SQUARE + (2.5, 0.0))], "bay"),
        ([("beside", SQUARE), ("bay", SQUARE + (2.5, 0.0))], "bay"),
        ([("beside", SQUARE), ("upper", BRACKET), ("lower", BRACKET * (1.0, -1.0))], "beside and upper and lower"),
        ([("beside", SQUARE)], ""),
        ([], ""),
    ],
)
def test_the_wall_that_bars_the_way_is_named(areas: list, name: str) -> None:
    state, now = begun(keep_outs(*areas))
    assert find_blocking_keep_outs(state, now) == name
