"""A start and a goal that someone gave are free, with a way between them, or refused by name."""

import pytest

from drake_starnav.errors import StarnavError
from drake_starnav.worlds.endpoints import check_free_ends, check_reachable
from drake_starnav.worlds.outlines import rectangle
from drake_starnav.worlds.world import World


def world(post: float, wall: float) -> World:
    """A post at (post, 1), and a wall at x = 2 that reaches up to `wall` in a room 2 m high."""
    return World(
        "ends",
        (0.5, 1.0, 0.0),
        (3.5, 1.0),
        cylinders=[(post, 1.0, 0.1)],
        polygons=[rectangle(1.95, 0.0, 2.05, wall)],
        bounds=(0.0, 0.0, 4.0, 2.0),
    )


def test_free_ends_with_a_way_between_them_pass() -> None:
    check_free_ends(world(1.2, 1.2), 0.25, "Here")
    check_reachable(world(1.2, 1.2), 0.25, "Here")


@pytest.mark.parametrize("end, post", [("start", 0.7), ("goal", 3.3)])
def test_an_end_that_touches_is_refused_unless_it_is_not_asked_for(end: str, post: float) -> None:
    with pytest.raises(StarnavError, match=rf"Here.{end} is .* allowed: more than robot_radius 0.25 m"):
        check_free_ends(world(post, 1.2), 0.25, "Here")
    check_free_ends(world(post, 1.2), 0.25, "Here", tuple({"start", "goal"} - {end}))


def test_a_goal_behind_a_gap_too_narrow_is_refused() -> None:
    with pytest.raises(StarnavError, match="Here.goal .* is out of reach"):
        check_reachable(world(1.2, 1.6), 0.25, "Here")
