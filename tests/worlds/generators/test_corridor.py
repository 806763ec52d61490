"""Corridors: as long as asked for, folded into lanes that are joined at alternating ends."""

import pytest

from drake_starnav.worlds import Corridor, find_shortest_path, make_world
from drake_starnav.worlds.generators.corridor import _WIDTH


@pytest.mark.parametrize("length", [20.0, 60.0])
def test_a_smooth_corridor_is_about_as_long_as_its_middle_line(length: float) -> None:
    world = make_world(Corridor(length=length, fin=0.0), 0, 0.25)
    found = find_shortest_path(world, 0.25)
    assert found is not None
    lanes = len(world.polygons) + 1
    assert length - 2.0 * lanes * _WIDTH < found[0] <= length
    assert world.timeout == pytest.approx(60.0 * length / 10.0)


def test_fins_stand_in_the_lanes_and_make_the_way_longer() -> None:
    smooth, winding = (make_world(Corridor(fin=fin), 1, 0.25) for fin in (0.0, 0.4))
    assert len(winding.polygons) > len(smooth.polygons)
    ways = [find_shortest_path(world, 0.25) for world in (smooth, winding)]
    assert ways[0] is not None and ways[1] is not None and ways[1][0] > ways[0][0]
