"""Rooms full of discs that move: these keep to the free floor, and to their numbers and speeds."""

import numpy as np
import pytest

from drake_starnav.errors import StarnavError
from drake_starnav.scenario import load_scenario
from drake_starnav.worlds import Crowd, clearance, make_world
from drake_starnav.worlds.moving_obstacles import moving_obstacle_states

RADIUS = 0.25
TIMES = np.arange(0.0, 200.0, 0.05)
WORLDS = [(Crowd(), seed) for seed in range(4)] + [(Crowd(width=20.0), seed) for seed in range(4)]


@pytest.mark.parametrize(("kind", "seed"), WORLDS)
def test_moving_obstacles_keep_to_the_free_floor(kind: Crowd, seed: int) -> None:
    world = make_world(kind, seed, RADIUS)
    positions, velocities = moving_obstacle_states(world.moving_obstacles, TIMES)
    for k, radius in enumerate(world.moving_obstacles.radii):
        assert clearance(world, positions[:, k]).min() >= radius
    speeds = np.hypot(velocities[..., 0], velocities[..., 1])
    assert speeds.min() >= kind.speed[0] - 1e-9
    assert speeds.max() <= kind.speed[1] + 1e-9
    assert np.ptp(speeds, axis=0) == pytest.approx(0.0, abs=1e-6), "each keeps its speed"
    assert kind.moving_obstacles[0] <= len(world.moving_obstacles) <= kind.moving_obstacles[1]


@pytest.mark.parametrize(("kind", "seed"), WORLDS)
def test_paths_close_so_that_no_moving_obstacle_jumps(kind: Crowd, seed: int) -> None:
    world = make_world(kind, seed, RADIUS)
    for path in world.moving_obstacles.paths:
        assert path[0, 1:] == pytest.approx(path[-1, 1:])
    positions, _ = moving_obstacle_states(world.moving_obstacles, TIMES)
    steps = np.hypot(*np.moveaxis(np.diff(positions, axis=0), -1, 0))
    assert steps.max() <= kind.speed[1] * 0.05 + 1e-9


@pytest.mark.parametrize(("kind", "seed"), WORLDS)
def test_start_is_free_and_the_goal_becomes_so(kind: Crowd, seed: int) -> None:
    world = make_world(kind, seed, RADIUS)
    at_start, _ = moving_obstacle_states(world.moving_obstacles, np.zeros(1))
    assert np.hypot(*(at_start[0] - world.start[:2]).T).min() >= 1.8
    positions, _ = moving_obstacle_states(world.moving_obstacles, TIMES)
    for k in range(len(world.moving_obstacles)):
        near = np.hypot(*(positions[:, k] - world.goal).T) < world.moving_obstacles.radii[k] + RADIUS
        spells = np.diff(np.flatnonzero(np.diff(np.concatenate(([0], near, [0])))))[::2]
        assert spells.max(initial=0) * 0.05 <= 10.2


def test_moving_obstacles_wander_far() -> None:
    world = make_world(Crowd(), 0, RADIUS)
    for path in world.moving_obstacles.paths:
        assert np.ptp(path[:, 1:], axis=0).max() > 2.0


def test_shipped_scenarios() -> None:
    assert make_world(load_scenario("crowd_room").world, 0, RADIUS).bounds == (0.0, 0.0, 12.0, 12.0)
    assert make_world(load_scenario("crowd_hall").world, 0, RADIUS).bounds == (0.0, 0.0, 20.0, 12.0)


def test_numbers_and_speeds_as_asked() -> None:
    world = make_world(Crowd(moving_obstacles=(3, 3), speed=(1.5, 1.5)), 1, RADIUS)
    assert len(world.moving_obstacles) == 3
    assert world.moving_obstacles.max_speed == pytest.approx(1.5)
    assert len(make_world(Crowd(moving_obstacles=(0, 0)), 1, RADIUS).moving_obstacles) == 0


@pytest.mark.parametrize(
    ("kind", "message"),
    [
        (
            Crowd(moving_obstacles=(5, 4)),
            r"Crowd\.moving_obstacles is \[5, 4\]; allowed: \[least, most\], 0 <= x <= 1000",
        ),
        (Crowd(speed=(0.0, 1.0)), r"Crowd\.speed is \[0\.0, 1\.0\]; allowed: \[least, most\], 0.01 <= x <= 5 m/s"),
    ],
)
def test_bad_parameters_are_refused(kind: Crowd, message: str) -> None:
    with pytest.raises(StarnavError, match=message):
        make_world(kind, 0, RADIUS)
