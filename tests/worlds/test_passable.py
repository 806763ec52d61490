"""Ways of a body that is no disc, where the disc inside it has one."""

import numpy as np
import pytest

from drake_starnav import StarnavError, World
from drake_starnav.geometry.footprint import disc, footprint
from drake_starnav.worlds.clearance import compute_clearance
from drake_starnav.worlds.outlines import make_rectangle
from drake_starnav.worlds.passable import has_passage
from drake_starnav.worlds.shortest_path import compute_capsule_distance, make_capsules
from drake_starnav.worlds.solvable import check_reachable, find_leg

CARRIER = footprint(((0.4, -0.25), (0.4, 0.25), (-0.4, 0.25), (-0.4, -0.25)))


def test_a_body_does_not_turn_where_only_its_disc_inside_does() -> None:
    """A corridor of 0.6 m with a corner, in which a carrier cannot turn; a goal that its heading keeps it from."""
    walls = [
        make_rectangle(-1.0, 0.3, 2.3, 0.4),
        make_rectangle(-1.0, -0.4, 1.7, -0.3),
        make_rectangle(2.3, -4.0, 2.4, 0.4),
    ]
    ends = make_rectangle(1.6, -4.0, 1.7, -0.3), make_rectangle(-1.1, -0.4, -1.0, 0.4)
    corner = World("corner", (0.0, 0.0, 0.0), (2.0, -2.5), polygons=(*walls, *ends))
    assert find_leg(corner, disc(0.25), corner.start, corner.goal) is not None
    assert find_leg(corner, CARRIER, corner.start, corner.goal) is None
    with pytest.raises(StarnavError, match="Here.goal .* is out of reach .* for a footprint that reaches 0.47"):
        check_reachable(corner, CARRIER, "Here")


@pytest.mark.parametrize(("door", "passes"), [(0.6, True), (0.49, False)])
def test_a_door_is_passed_lengthwise_and_a_heading_behind_it_turned_to(door: float, passes: bool) -> None:
    half = 0.5 * door
    walls = [make_rectangle(1.9, -2.0, 2.1, -half), make_rectangle(1.9, half, 2.1, 2.0)]
    world = World("door", (0.0, 0.0, 1.0), (4.0, 0.5), polygons=tuple(walls), bounds=(-2.0, -2.0, 6.0, 2.0))
    assert has_passage(world, CARRIER) == passes
    assert has_passage(world, CARRIER, yaw=1.6) == passes
    assert not has_passage(world, CARRIER, spare=0.06)


def test_a_place_is_as_far_from_the_capsules_as_from_the_obstacles() -> None:
    rng = np.random.default_rng(0)
    polygons = (make_rectangle(-1.0, -1.0, 1.0, -0.5), make_rectangle(2.0, 2.0, 2.5, 3.0))
    world = World(
        "mixed", (0.0, 0.0, 0.0), (1.0, 1.0), cylinders=[(3.0, 0.0, 0.5)], polygons=polygons, bounds=(-4, -4, 4, 4)
    )
    places = rng.uniform(-3.9, 3.9, (300, 2))
    free = places[compute_clearance(world, places) > 0.0]
    found = [compute_capsule_distance(make_capsules(world, 0.3), *place) for place in free]
    assert found == pytest.approx(compute_clearance(world, free) - 0.3)
