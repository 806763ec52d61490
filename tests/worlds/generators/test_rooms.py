"""Rooms are all joined, their doors are as wide as asked, and the goal is as close to its walls."""

import numpy as np
import pytest

from drake_starnav.errors import StarnavError
from drake_starnav.worlds import compute_clearance, find_shortest_path, make_world
from drake_starnav.worlds.generators import rooms
from drake_starnav.worlds.generators.rooms import _SIZE, Rooms

RADIUS = 0.25
WALL = 0.1
KINDS = [Rooms(goal=goal, goal_clearance=spare) for goal in ("wall", "corner", "niche") for spare in (0.02, 0.1)]


@pytest.mark.parametrize("seed", range(2))
@pytest.mark.parametrize("kind", KINDS, ids=lambda kind: f"{kind.goal}-{kind.goal_clearance}")
def test_the_goal_is_reached_and_as_close_to_its_walls_as_asked(kind, seed):
    world = make_world(kind, seed, RADIUS)
    goal = np.array([world.goal])
    assert compute_clearance(world, goal)[0] == pytest.approx(RADIUS + kind.goal_clearance, abs=1e-6)
    assert find_shortest_path(world, RADIUS + 0.5 * kind.goal_clearance, 0.02) is not None
    assert compute_clearance(world, np.array([world.start[:2]]))[0] >= 0.5 * _SIZE - WALL


def doors(world, kind: Rooms) -> dict[tuple[int, int, int], float]:
    """The width of the door in each wall between two rooms, 0 where there is none, by axis and place of the wall."""
    out = {}
    step = np.arange(0.0005, _SIZE, 0.001)
    for axis in (0, 1):
        for i, j in np.ndindex(kind.count - 1, kind.count):
            wall = np.column_stack((np.full(len(step), (i + 1) * _SIZE), j * _SIZE + step))
            free = compute_clearance(world, wall if axis == 0 else wall[:, ::-1]) > 0.0
            out[axis, i, j] = 0.001 * float(free.sum())
            assert np.abs(np.diff(free.astype(int))).sum() in (0, 2), "one door in a wall, off its ends"
    return out


@pytest.mark.parametrize("shut", [0.0, 0.5, 1.0])
@pytest.mark.parametrize(("count", "seed"), [(2, 0), (4, 1)])
def test_doors_are_as_wide_as_asked_and_join_all_rooms(shut, seed, count, monkeypatch):
    monkeypatch.setattr(rooms, "_SHUT", shut)
    kind = Rooms(count=count, door=0.8)
    widths = doors(make_world(kind, seed, RADIUS), kind)
    for width in widths.values():
        assert width == 0.0 or width == pytest.approx(kind.door, abs=0.003)
    open_doors = [key for key, width in widths.items() if width]
    group = {(x, y): (x, y) for x in range(count) for y in range(count)}
    for axis, i, j in open_doors:
        here, there = ((i, j), (i + 1, j)) if axis == 0 else ((j, i), (j, i + 1))
        before, after = group[there], group[here]
        group = {room: after if of == before else of for room, of in group.items()}
    assert len(set(group.values())) == 1
    assert len(open_doors) >= count * count - 1
    if shut in (0.0, 1.0):
        assert len(open_doors) == (2 * count * (count - 1) if shut == 0.0 else count * count - 1)


def test_each_kind_of_goal_comes_about():
    goals = [make_world(Rooms(), seed, RADIUS) for seed in range(20)]
    side = Rooms().count * _SIZE
    off = RADIUS + Rooms().goal_clearance
    corner = [np.allclose(world.goal, side - off) for world in goals]
    beside = np.array((0.0, off + 0.03))  # inside a wall of a niche
    niche = [compute_clearance(world, (world.goal + beside)[None])[0] < 0.0 and not c
             for world, c in zip(goals, corner, strict=True)]  # fmt: skip
    assert any(corner) and any(niche) and sum(corner) + sum(niche) < len(goals)


@pytest.mark.parametrize(
    ("kind", "message"),
    [
        (Rooms(door=0.45), r"Rooms\.door is 0\.45 m .* allowed: wider than the robot, 0\.5 m, and at most 2\.3 m"),
        (Rooms(door=0.5), r"Rooms\.door is 0\.5 m"),
        (Rooms(door=2.4), r"Rooms\.door is 2\.4 m .* at most 2\.3 m"),
        (Rooms(goal="niche", goal_clearance=1.5), r"Rooms\.goal_clearance is 1\.5 m .* allowed: at most 1\.45 m"),
        (Rooms(goal="wall", goal_clearance=1.96), r"Rooms\.goal_clearance is 1\.96 m .* allowed: at most 1\.95 m"),
    ],
    ids=str,
)
def test_sizes_that_make_no_world_are_refused(kind, message):
    with pytest.raises(StarnavError, match=message):
        make_world(kind, 0, RADIUS)
