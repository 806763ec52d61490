"""Worlds are drawn until one can be solved; a generator that never draws one says so."""

import itertools
import math
from collections.abc import Iterable, Iterator

import numpy as np
import pytest

from drake_starnav import StarnavError, World
from drake_starnav.geometry.footprint import disc, footprint
from drake_starnav.worlds.outlines import make_rectangle, place
from drake_starnav.worlds.solvable import Drawn, check_ends, check_free, check_reachable, find_leg, is_free


class Gate(Drawn):
    """A room with a wall that leaves a gap, the next of some."""

    def __init__(self, gaps: Iterable[float]) -> None:
        """Takes the gaps, m."""
        self.gaps: Iterator[float] = iter(gaps)

    def draw(self, rng: np.random.Generator) -> World:
        wall = make_rectangle(1.95, 0.0, 2.05, 2.0 - next(self.gaps))
        return World("gate", (0.6, 1.0, 0.0), (3.4, 1.0), polygons=[wall], bounds=(0, 0, 4.0, 2.0))


def test_the_first_world_with_room_to_spare_is_taken() -> None:
    gate = Gate((0.3, 0.55, 0.7, 0.9))
    world = gate.make(np.random.default_rng(0), disc(0.25))
    assert next(gate.gaps) == 0.9  # 0.55 m is enough for the robot, but not with 5 cm to each side
    assert world.polygons[0][:, 1].max() == pytest.approx(1.3)


def test_where_no_world_is_solvable_the_generator_is_named() -> None:
    with pytest.raises(StarnavError, match=r"Gate: none of \d+ worlds was solvable for robot.radius 0.25 m"):
        Gate(itertools.repeat(0.1)).make(np.random.default_rng(0), disc(0.25))


def world(post: float, wall: float) -> World:
    """A post at (post, 1), and a wall at x = 2 that reaches up to `wall` in a room 2 m high."""
    parts = {"cylinders": [(post, 1.0, 0.1)], "polygons": [make_rectangle(1.95, 0.0, 2.05, wall)]}
    return World("ends", (0.5, 1.0, 0.0), (3.5, 1.0), **parts, bounds=(0.0, 0.0, 4.0, 2.0))


def test_where_an_end_lies_that_touches_or_is_out_of_reach_is_said() -> None:
    for end, post in (("start", 0.7), ("goal", 3.3)):
        with pytest.raises(StarnavError, match=rf"Here.{end} is .* allowed: more than robot.radius 0.25 m"):
            check_ends(world(post, 1.2), 0.25, "Here")
    with pytest.raises(StarnavError, match="Here.goal .* is out of reach"):
        check_reachable(world(1.2, 1.6), 0.25, "Here")
    for x, said in ((0.75, r"0\.15 m from cylinders"), (1.05, "inside cylinders"), (-3.0, "outside of bounds")):
        with pytest.raises(StarnavError, match=rf"Here is .*, {said}"):
            check_free(world(1.0, 1.2), (x, 1.0), 0.25, "Here")


CARRIER = footprint(((0.4, -0.25), (0.4, 0.25), (-0.4, 0.25), (-0.4, -0.25)))
CAR = footprint(((0.48, -0.15), (0.48, 0.15), (-0.12, 0.15), (-0.12, -0.15)))


def lane(width: float, yaw: float = 0.0, turn: float = 0.0) -> World:
    """A straight corridor of that width, turned about its start; the robot stands in it along `yaw`."""
    half = 0.5 * width
    walls = make_rectangle(-1.5, -half - 0.2, 4.5, -half), make_rectangle(-1.5, half, 4.5, half + 0.2)
    goal, *polygons = (place(points, (0.0, 0.0), turn) for points in (np.array((3.0, 0.0)), *walls))
    return World("lane", (0.0, 0.0, turn + yaw), tuple(goal), polygons=polygons)


@pytest.mark.parametrize("turn", [0.0, 0.37, 1.1])
@pytest.mark.parametrize(
    ("body", "width", "passes"), [(CARRIER, 0.62, True), (CARRIER, 0.45, False), (CAR, 0.42, True), (CAR, 0.25, False)]
)
def test_a_body_passes_lengthwise_what_the_disc_around_it_does_not(
    body, width: float, passes: bool, turn: float
) -> None:
    ahead = lane(width, 0.0, turn)
    assert width < 2.0 * body.radius and is_free(ahead, ahead.start, body) == passes
    assert is_free(ahead, ahead.goal, body) == passes  # at some heading
    found = find_leg(ahead, body, ahead.start, ahead.goal)
    assert (found is not None) == passes
    if found is not None:
        assert found[0] == pytest.approx(3.0, abs=0.01)
        check_ends(ahead, body, "Here")
        check_reachable(ahead, body, "Here", [(*ahead.goal, turn)])
    across = lane(width, 0.5 * math.pi, turn)
    with pytest.raises(StarnavError, match=r"Here.start is \[0, 0, .*\], where the robot touches polygons\[[01]\]; "):
        check_ends(across, body, "Here")
    with pytest.raises(StarnavError, match=r"goals\[0\] is .*, where the robot touches polygons"):
        check_free(ahead, (*ahead.goal, turn + 0.5 * math.pi), body, "goals[0]")
