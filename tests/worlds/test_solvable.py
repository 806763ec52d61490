"""Worlds are drawn until one can be solved; a generator that never draws one says so."""

import math
from dataclasses import dataclass

import numpy as np
import pytest

from drake_starnav.errors import StarnavError
from drake_starnav.parameters import parameter
from drake_starnav.worlds.outlines import rectangle
from drake_starnav.worlds.solvable import check_robot_radius, first_solvable, random_yaw
from drake_starnav.worlds.world import World


@dataclass(frozen=True)
class Gate:
    """A room with a wall that leaves a gap."""

    low: float = parameter(0.0, "one end", low=0.0)
    high: float = parameter(1.0, "the other end", low=0.0)


def gate(gap: float) -> World:
    return World(
        "gate", (0.6, 1.0, 0.0), (3.4, 1.0), polygons=[rectangle(1.95, 0.0, 2.05, 2.0 - gap)], bounds=(0, 0, 4.0, 2.0)
    )


def test_the_first_world_with_room_to_spare_is_taken() -> None:
    gaps = iter((0.3, 0.55, 0.7, 0.9))
    world = first_solvable(Gate(), lambda rng: gate(next(gaps)), np.random.default_rng(0), 0.25)
    assert next(gaps) == 0.9  # 0.55 m is enough for the robot, but not with 5 cm to each side
    assert world.polygons[0][:, 1].max() == pytest.approx(1.3)


def test_where_no_world_is_solvable_the_generator_is_named() -> None:
    with pytest.raises(StarnavError, match=r"Gate: none of \d+ worlds was solvable for robot_radius 0.25 m"):
        first_solvable(Gate(), lambda rng: gate(0.1), np.random.default_rng(0), 0.25)


@pytest.mark.parametrize("radius", [0.0, -1.0, math.inf, math.nan])
def test_a_radius_is_a_positive_length(radius: float) -> None:
    with pytest.raises(StarnavError, match="robot_radius is"):
        check_robot_radius(radius)


def test_headings_are_in_one_turn() -> None:
    yaws = [random_yaw(np.random.default_rng(k)) for k in range(100)]
    assert min(yaws) < -2.5 and max(yaws) > 2.5 and all(-math.pi <= yaw < math.pi for yaw in yaws)
