"""Discs that stand and walk: they keep to the room, to their times and to their speeds."""

import numpy as np
import pytest

from drake_starnav.errors import StarnavError
from drake_starnav.scenario import load_scenario
from drake_starnav.worlds import StopAndGo, World, make_world
from drake_starnav.worlds.generators.stop_and_go import _walk
from drake_starnav.worlds.moving_obstacles import moving_obstacle_states

RADIUS = 0.25


def legs(world: World) -> list[tuple[np.ndarray, np.ndarray]]:
    """Duration and speed of each leg of each disc."""
    steps = [np.diff(path, axis=0) for path in world.moving_obstacles.paths]
    return [(step[:, 0], np.hypot(step[:, 1], step[:, 2]) / step[:, 0]) for step in steps]


@pytest.mark.parametrize("seed", range(6))
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


@pytest.mark.parametrize("seed", range(6))
def test_discs_keep_to_the_room_and_away_from_the_start(seed: int) -> None:
    world = make_world(StopAndGo(), seed, RADIUS)
    x_min, y_min, x_max, y_max = world.bounds
    positions, _ = moving_obstacle_states(world.moving_obstacles, np.arange(0.0, 150.0, 0.05))
    reach = world.moving_obstacles.radii + 0.1 - 1e-9
    assert (positions[..., 0] >= x_min + reach).all() and (positions[..., 0] <= x_max - reach).all()
    assert (positions[..., 1] >= y_min + reach).all() and (positions[..., 1] <= y_max - reach).all()
    assert np.hypot(*(positions[0] - world.start[:2]).T).min() >= 1.8
    for path in world.moving_obstacles.paths:
        assert path[0, 1:] == pytest.approx(path[-1, 1:])


def test_the_shipped_scenario_declares_what_moves() -> None:
    scenario = load_scenario("stop_and_go")
    assert make_world(scenario.world, 0, RADIUS).moving_obstacles.max_speed <= scenario.obstacles.max_speed
    assert scenario.obstacles.caution == 1.0


@pytest.mark.parametrize(
    ("kind", "message"),
    [
        (
            StopAndGo(speed=(2.0, 1.5)),
            r"StopAndGo\.speed is \[2\.0, 1\.5\]; allowed: \[least, most\], 0.01 <= x <= 5 m/s",
        ),
        (StopAndGo(moving_obstacles=-1), r"StopAndGo\.moving_obstacles is -1; allowed: 0 <= x <= 1000"),
    ],
)
def test_bad_parameters_are_refused(kind: StopAndGo, message: str) -> None:
    with pytest.raises(StarnavError, match=message):
        make_world(kind, 0, RADIUS)


def test_what_finds_no_room_is_refused() -> None:
    with pytest.raises(StarnavError, match="none of 1000 walks at 50 m/s stays in the room"):
        _walk(np.zeros(2), 50.0, np.full(2, -3.0), np.full(2, 3.0), np.random.default_rng(0))
    with pytest.raises(StarnavError, match=r"robot_radius 0\.9 m does not fit at the start; allowed: below 0\.8 m"):
        make_world(StopAndGo(), 0, 0.9)
