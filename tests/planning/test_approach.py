"""Where a robot arrives if its goal is closer to a wall than it may drive."""

import numpy as np
import pytest
from hypothesis import given, settings

from drake_starnav.planning.grid import HIT_ERROR, Grid
from drake_starnav.planning.route import INSIDE_TOLERANCE, LINE_CLEARANCE, list_goal_candidates
from tests.helpers.scans import RADIUS, seeds

RESOLUTION = 0.05
MARGIN = 0.03
NEEDED = RADIUS + MARGIN + HIT_ERROR * RADIUS


def memory(*walls: tuple[tuple[float, float], tuple[float, float]]) -> Grid:
    """Hits along straight walls, each given by its ends, m."""
    points = [np.linspace(a, b, int(np.hypot(*np.subtract(b, a)) / 0.02) + 1) for a, b in walls]
    return Grid.empty(RESOLUTION, RADIUS).add_hits(np.vstack(points))


WALL = ((0.0, -2.0), (0.0, 2.0))


def away(places: np.ndarray, goal: np.ndarray) -> np.ndarray:
    return np.hypot(*(places - goal).T)


@pytest.mark.parametrize(
    ("x", "tolerance", "hits"),
    [
        (0.4, 0.3, Grid.empty(RESOLUTION, RADIUS)),
        (0.4, 0.3, memory(WALL)),
        (0.2, 0.0, memory(WALL)),
        (0.2, INSIDE_TOLERANCE * RADIUS, memory(WALL)),
        (0.5 * LINE_CLEARANCE * RADIUS, 0.3, memory(WALL)),  # at the wall it is seen from nowhere
    ],
)
def test_a_goal_that_is_free_not_known_without_tolerance_or_at_a_wall_is_driven_to(x, tolerance, hits):
    found = list_goal_candidates(hits, np.array((x, 0.0)), tolerance, RADIUS, MARGIN)
    assert found.goal.tolist() == [x, 0.0] and found.places.tolist() == [[x, 0.0]]


def test_beside_a_wall_it_is_the_nearest_clear_place_straight_off_it():
    goal, tolerance = np.array((0.2, 0.1)), 0.3
    found = list_goal_candidates(memory(WALL), goal, tolerance, RADIUS, MARGIN)
    assert NEEDED - 0.5 * RESOLUTION <= found.goal[0] < NEEDED + 1.5 * RESOLUTION
    assert abs(found.goal[1] - goal[1]) < RESOLUTION


def test_places_behind_a_thin_wall_are_none():
    """Behind the wall there is room within the tolerance; in front of it a second wall leaves too little."""
    hits = memory(WALL, ((0.5, -2.0), (0.5, 2.0)))
    goal = np.array((0.2, 0.0))
    behind = np.array((-0.35, 0.0))
    assert hits.distance(behind[None])[0] >= NEEDED and away(behind[None], goal)[0] < 0.65 - INSIDE_TOLERANCE * RADIUS
    found = list_goal_candidates(hits, goal, 0.65, RADIUS, MARGIN)
    assert (found.places[:, 0] > 0.0).all() and (found.places[:, 0] < 0.5).all()
    assert 0.2 <= found.goal[0] <= 0.3


@settings(max_examples=50)
@given(seeds)
def test_any_place_is_within_the_tolerance_in_sight_and_the_nearest_comes_first(seed):
    rng = np.random.default_rng(seed)
    points = rng.uniform(-1.5, 1.5, (25, 2))
    hits = Grid.empty(RESOLUTION, RADIUS).add_hits(points)
    goal, tolerance = rng.uniform(-1.0, 1.0, 2), float(rng.uniform(0.0, 0.6))
    found = list_goal_candidates(hits, goal, tolerance, RADIUS, MARGIN)
    if found.places.tolist() == [goal.tolist()]:
        assert found.goal.tolist() == goal.tolist()
        return
    distance, lengths = hits.distance(found.places), away(found.places, goal)
    assert hits.distance(goal[None])[0] < NEEDED
    assert lengths.max() <= tolerance - INSIDE_TOLERANCE * RADIUS + 1e-9 and (np.diff(lengths) >= -1e-9).all()
    middle = 0.5 * (found.places + goal)
    nearest = np.hypot(*np.moveaxis(middle[:, None] - points, -1, 0)).min(axis=1)
    assert nearest.min() > LINE_CLEARANCE * RADIUS - 2.0 * RESOLUTION
    clear = np.flatnonzero(distance >= NEEDED)
    chosen = clear[0] if len(clear) else np.argmax(distance)
    assert found.goal.tolist() == found.places[chosen].tolist()
