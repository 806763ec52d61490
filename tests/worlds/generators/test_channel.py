"""Channels have a way by construction, as wide as asked everywhere."""

import math

import numpy as np
import pytest

from drake_starnav.worlds import compute_clearance, find_shortest_path, make_world
from drake_starnav.worlds.generators import channel
from drake_starnav.worlds.generators.channel import _SHAPES, Channel, _make_middle_line

RADIUS = 0.25


def placed(line: np.ndarray, world, step: float = 0.02) -> tuple[np.ndarray, np.ndarray]:
    """Places on the middle line of a channel, and the direction there, each shape (n, 2), W."""
    edge = world.polygons[0][1] - world.polygons[0][0]  # along the channel's x axis
    x = edge / np.hypot(*edge)
    line = line @ np.array((x, (-x[1], x[0])))
    places, directions = [], []
    for a, b in zip(line, line[1:], strict=False):
        length = float(np.hypot(*(b - a)))
        places.append(a + (b - a) * np.linspace(0.0, 1.0, int(length / step) + 2)[:, None])
        directions.append(np.broadcast_to((b - a) / length, places[-1].shape))
    return np.vstack(places), np.vstack(directions)


@pytest.mark.parametrize(
    ("length", "lanes", "wall", "spare"),
    [(2.0, 3, 0.4, 0.05), (5.0, 8, 0.03, 0.05), (4.0, 5, 0.1, 0.3), (2.5, 9, 0.1, 0.05)],
)
@pytest.mark.parametrize("shape", _SHAPES)
def test_the_way_is_exactly_as_wide_as_asked(shape, length, lanes, wall, spare, monkeypatch):
    for name, value in (("_LENGTHS", length), ("_LANES", lanes), ("_WALLS", wall)):
        monkeypatch.setattr(channel, name, (value, value))
    world = make_world(Channel(shape, spare), 0, RADIUS)
    half = RADIUS + spare
    places, direction = placed(_make_middle_line(shape, length, lanes, 2.0 * half + wall), world)
    np.testing.assert_allclose(places[[0, -1]], (world.start[:2], world.goal), atol=1e-9)
    np.testing.assert_allclose(compute_clearance(world, places), half, atol=1e-6)
    ends = np.min([np.hypot(*(places - p).T) for p in corners(places, direction)], axis=0)
    straight = ends > half + wall + 0.01  # beside a corner the other run is open
    normal = direction[:, ::-1] * (-1.0, 1.0)
    for side in (-1.0, 1.0):
        edge = compute_clearance(world, (places + side * (half + 0.005) * normal)[straight])
        assert (edge < 0.0).all(), "there is a wall on both sides"
        assert (compute_clearance(world, (places + side * (half - 0.005) * normal)[straight]) > 0.0).all()


def corners(places: np.ndarray, direction: np.ndarray) -> np.ndarray:
    turns = np.flatnonzero(np.abs(np.diff(direction, axis=0)).max(axis=1) > 1e-9)
    return places[np.concatenate(([0], turns, [len(places) - 1]))]


@pytest.mark.parametrize("seed", range(4))
def test_any_channel_is_solvable_and_its_walls_close_it(seed):
    world = make_world(Channel(), seed, RADIUS)
    length, path = find_shortest_path(world, RADIUS + 0.02, 0.02)
    assert compute_clearance(world, path).min() >= RADIUS + 0.02 - 1e-6
    assert length < 0.05 * (world.timeout - 60.0) + 1e-6, "the time limit allows for the middle line"
    ends = compute_clearance(world, np.array((world.start[:2], world.goal)))
    np.testing.assert_allclose(ends, RADIUS + Channel().clearance, atol=1e-6)
    assert -math.pi <= world.start[2] < math.pi
