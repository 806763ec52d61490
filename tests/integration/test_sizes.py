"""Robots of any size drive alike in worlds of their size: no length is tuned for one robot."""

import functools

import pytest

from tests.helpers.sizes import ratios

usual = functools.cache(functools.partial(ratios, scale=1.0))


@pytest.mark.parametrize("scale", [0.32, 4.0], ids=["radius 0.08 m", "radius 1 m"])
def test_a_small_and_a_large_robot_cross_a_room_like_the_usual_one(scale: float) -> None:
    seeds = range(1000, 1001)
    assert ratios("room", scale, seeds) == pytest.approx(usual("room", seeds=seeds), rel=0.05)


SPREAD = {("room", 0.32): 0.08, ("forest", 12.0): 0.12, ("maze", 12.0): 0.08}
"""Where the means of so few drives differ by more than 5 %: some pass an obstacle on its other side."""


@pytest.mark.slow
@pytest.mark.parametrize("scale", [0.32, 4.0, 12.0], ids=["radius 0.08 m", "radius 1 m", "radius 3 m"])
@pytest.mark.parametrize(("name", "count"), [("room", 6), ("forest", 6), ("maze", 12)])
def test_times_and_paths_scale_with_world_robot_and_lidar(name: str, count: int, scale: float) -> None:
    seeds, within = range(1000, 1000 + count), SPREAD.get((name, scale), 0.05)
    assert ratios(name, scale, seeds) == pytest.approx(usual(name, seeds=seeds), rel=within)
