"""Rooms full of discs that move: these keep to the free floor, and to their numbers and speeds."""

import numpy as np
import pytest

from drake_starnav.scenario.scenario_file import load_scenario
from drake_starnav.worlds import Crowd, StopAndGo, World, compute_clearance, make_world, moving_obstacle_states
from drake_starnav.worlds.generators.crowd import draw_wandering_path

RADIUS = 0.25
TIMES = np.arange(0.0, 200.0, 0.05)
WORLDS = [(Crowd(), 0), (Crowd(width=20.0), 1)]


@pytest.mark.parametrize(("kind", "seed"), WORLDS)
def test_moving_obstacles_keep_to_the_free_floor_and_to_their_speeds(kind: Crowd, seed: int) -> None:
    world = make_world(kind, seed, RADIUS)
    positions, velocities = moving_obstacle_states(world.moving_obstacles, TIMES)
    for k, radius in enumerate(world.moving_obstacles.radii):
        assert compute_clearance(world, positions[:, k]).min() >= radius
    speeds = np.hypot(velocities[..., 0], velocities[..., 1])
    assert speeds.min() >= kind.speed[0] - 1e-9
    assert speeds.max() <= kind.speed[1] + 1e-9
    assert np.ptp(speeds, axis=0) == pytest.approx(0.0, abs=1e-6), "each keeps its speed"
    assert kind.moving_obstacles[0] <= len(world.moving_obstacles) <= kind.moving_obstacles[1]

    steps = np.hypot(*np.moveaxis(np.diff(positions, axis=0), -1, 0))
    assert steps.max() <= kind.speed[1] * 0.05 + 1e-9, "none jumps, for its path closes"


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


def test_numbers_and_speeds_as_asked() -> None:
    world = make_world(Crowd(moving_obstacles=(3, 3), speed=(1.5, 1.5)), 1, RADIUS)
    assert len(world.moving_obstacles) == 3
    assert world.moving_obstacles.max_speed == pytest.approx(1.5)
    assert len(make_world(Crowd(moving_obstacles=(0, 0)), 1, RADIUS).moving_obstacles) == 0


def test_a_disc_that_cannot_move_has_no_way() -> None:
    closet = World("closet", (0.5, 0.5, 0.0), (0.5, 0.5), bounds=(0.0, 0.0, 0.61, 0.61))
    assert draw_wandering_path(closet, np.array([0.305, 0.305]), 0.3, 0.5, False, np.random.default_rng(0)) is None


def legs(world: World) -> list[tuple[np.ndarray, np.ndarray]]:
    """Duration and speed of each leg of each disc."""
    steps = [np.diff(path, axis=0) for path in world.moving_obstacles.paths]
    return [(step[:, 0], np.hypot(step[:, 1], step[:, 2]) / step[:, 0]) for step in steps]


@pytest.mark.parametrize("seed", range(3))
def test_each_disc_stands_first_and_then_walks_at_one_speed(seed: int) -> None:
    kind = StopAndGo()
    world = make_world(kind, seed, RADIUS)
    assert len(world.moving_obstacles) == 8
    assert ((world.moving_obstacles.radii >= 0.15) & (world.moving_obstacles.radii <= 0.3)).all()
    for duration, speed in legs(world):
        stands = speed < 1e-9
        assert stands[0]
        assert np.count_nonzero(~(stands[:-1] | stands[1:])) == 1  # only where it turns back, it walks on
        assert (duration[stands] >= 0.5 - 1e-9).all() and (duration[stands] <= 6.0 + 1e-9).all()
        assert np.ptp(speed[~stands]) < 1e-6
        assert kind.speed[0] <= speed[~stands][0] <= kind.speed[1] + 1e-9


def test_the_shipped_scenario_declares_what_moves() -> None:
    scenario = load_scenario("stop_and_go")
    assert make_world(scenario.world, 0, RADIUS).moving_obstacles.max_speed <= scenario.obstacles.max_speed
    assert scenario.obstacles.caution == 1.0
