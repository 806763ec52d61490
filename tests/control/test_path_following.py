import dataclasses
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from drake_starnav.control import ControllerInputs
from drake_starnav.control.parameters import ControllerParameters
from drake_starnav.control.path_following import (
    CREEP,
    GOAL_REACHED,
    MODULATION_DISTANCE,
    compute_goal_slowdown,
    follow_guidance,
    guiding_vector,
)
from drake_starnav.planning.guidance import PASSED_DISTANCE, Guidance
from drake_starnav.robot import BASES, RobotParameters
from drake_starnav.robot.limits import HEADING_GAIN
from drake_starnav.surroundings.recent_hits import Hits
from drake_starnav.surroundings.region_union import RegionUnion
from drake_starnav.surroundings.star_region import unite_regions
from drake_starnav.surroundings.surroundings import Surroundings
from drake_starnav.utils.snapshot import replace_fields
from tests.helpers.motions import only_star, stepped
from tests.helpers.scans import RADIUS, seeds, smooth_region

ROBOT = RobotParameters()
PARAMETERS = ControllerParameters()
PERIOD = 1.0 / PARAMETERS.rate
OPEN = only_star(np.full(720, 100.0))


def step(
    pose=(0.0, 0.0, 0.0), twist=(0.0, 0.0), path=((5.0, 0.0),), arrives=False, star=OPEN
) -> tuple[np.ndarray, bool]:
    """The twist of the next period, and whether it is certified."""
    guidance = Guidance(np.array(path).reshape(-1, 2), arrives, RegionUnion.none())
    return stepped(ControllerInputs(np.array(pose), np.array(twist), guidance, star), PARAMETERS, ROBOT)


def settled(**arguments) -> np.ndarray:
    """The twist after many periods at one pose."""
    twist = np.zeros(2)
    for _ in range(200):
        twist, _ = step(twist=twist, **arguments)
    return twist


@pytest.mark.parametrize("twist", [(0.8, 0.0), (0.5, -2.0), (0.0, 1.0)])
def test_an_empty_path_stops_the_robot_as_fast_as_it_can(twist):
    now, periods = np.array(twist), 0
    while now.any():
        driven, _ = step(twist=now, path=())
        change = PERIOD * np.array((ROBOT.max_acceleration, ROBOT.max_yaw_acceleration))
        np.testing.assert_allclose(driven, np.sign(now) * np.maximum(np.abs(now) - change, 0.0), atol=1e-12)
        now, periods = driven, periods + 1
    assert periods <= math.ceil(max(twist[0] / ROBOT.max_acceleration, abs(twist[1]) / 4.0) / PERIOD) + 1


def test_it_slows_down_at_the_goal_only():
    near = ((0.3, 0.0),)
    assert settled(path=near)[0] == pytest.approx(ROBOT.max_speed)
    slow = compute_goal_slowdown(ROBOT.limits) * 0.3 + ROBOT.max_speed / CREEP
    assert settled(path=near, arrives=True)[0] == pytest.approx(slow)
    assert settled(path=(*near, (5.0, 0.0)), arrives=True)[0] == pytest.approx(ROBOT.max_speed)
    assert settled(path=((5.0, 0.0),), arrives=True)[0] == pytest.approx(ROBOT.max_speed)
    assert settled(path=((1.5 * GOAL_REACHED * RADIUS, 0.0),), arrives=True)[0] > 0.0  # it does arrive
    assert settled(path=((0.5 * GOAL_REACHED * RADIUS, 0.0),), arrives=True) == pytest.approx([0.0, 0.0])
    beside = ((0.0, 0.5 * GOAL_REACHED * RADIUS),)
    assert settled(path=beside, arrives=True) == pytest.approx([0.0, 0.0])  # it need not turn


@pytest.mark.parametrize(("speed", "braking"), [(0.8, 0.1), (0.8, 1.0), (3.0, 0.5), (2.0, 3.0), (0.05, 20.0)])
def test_a_robot_arrives_with_the_brakes_that_it_has(speed: float, braking: float) -> None:
    """What it is asked to do needs no more, whatever it can brake, and steps of the loop do not overshoot."""
    slowdown = compute_goal_slowdown(RobotParameters(max_speed=speed, max_acceleration=braking).limits)
    assert slowdown * speed <= braking
    assert slowdown * PERIOD < 0.5


@settings(max_examples=40)
@given(st.floats(-3.1, 3.1))
def test_the_law_turns_towards_the_guiding_vector_and_drives_when_it_faces_it(yaw):
    v, omega = settled(pose=(0.0, 0.0, yaw))
    assert v == pytest.approx(ROBOT.max_speed * max(math.cos(yaw), 0.0) ** 3, abs=1e-9)
    turn = min(max(-HEADING_GAIN * yaw, -ROBOT.max_yaw_rate), ROBOT.max_yaw_rate)
    assert omega == pytest.approx(turn, abs=1e-9)


@settings(max_examples=40)
@given(seeds)
def test_the_guiding_vector_points_to_the_first_way_point_that_is_not_passed(seed):
    rng = np.random.default_rng(seed)
    position = rng.uniform(-3.0, 3.0, 2)
    passed = position + rng.uniform(-0.7, 0.7, 2) * PASSED_DISTANCE * RADIUS
    ahead, later = position + rng.uniform(0.1, 0.2, 2), position + 5.0
    path = np.array((passed, ahead, later))
    *direction, distance = guiding_vector(*position, path, RegionUnion.none(), RADIUS)
    assert distance == pytest.approx(np.hypot(*(ahead - position)))
    np.testing.assert_allclose(direction, (ahead - position) / distance)
    *last, left = guiding_vector(*position, path[:1], RegionUnion.none(), RADIUS)
    assert left == pytest.approx(np.hypot(*(passed - position)))
    np.testing.assert_allclose(last, (passed - position) / left)


def test_at_the_last_way_point_there_is_nowhere_to_go():
    assert guiding_vector(1.0, 1.0, np.ones((1, 2)), RegionUnion.none(), RADIUS) == (0.0, 0.0, 0.0)


def test_modulation_ends_near_the_short_term_goal():
    region = smooth_region(np.random.default_rng(2), np.array((-1.0, 0.2)))
    regions = unite_regions((region,))
    for away, bent in ((MODULATION_DISTANCE * RADIUS - 0.01, False), (MODULATION_DISTANCE * RADIUS + 0.01, True)):
        path = away * np.array(((0.6, 0.8),))
        *direction, _ = guiding_vector(0.0, 0.0, path, regions, RADIUS)
        assert (math.dist(direction, (0.6, 0.8)) > 1e-3) == bent


@pytest.mark.parametrize("base", BASES)
def test_a_round_robot_of_any_base_heads_for_its_way_point_beside_hits(base: str) -> None:
    robot, hits = RobotParameters(base=base), np.array([(1.0, 0.5), (1.0, -0.5)])
    star = dataclasses.replace(OPEN.certified_star, boundary=Hits(hits, np.zeros(2)))
    surroundings = replace_fields(OPEN, certified_star=star)
    guidance = Guidance(np.array([(3.0, 0.0)]), False, RegionUnion.none())
    inputs = ControllerInputs(np.zeros(3), np.zeros(len(robot.drive.components)), guidance, surroundings)
    twist = follow_guidance(inputs, robot).twist
    assert len(twist) == len(robot.drive.components)
    assert robot.drive.body_rates(twist)[0] > 0.5


@pytest.mark.parametrize("base", BASES)
@pytest.mark.parametrize("surroundings", [OPEN, Surroundings.unknown()], ids=["open", "unknown"])
def test_a_robot_of_any_base_without_a_way_stands_and_leaves_its_input_alone(base: str, surroundings) -> None:
    robot = RobotParameters(base=base)
    arrays = np.zeros(3), np.zeros(len(robot.drive.components))
    proposal = follow_guidance(ControllerInputs(*arrays, Guidance.none(), surroundings), robot)
    np.testing.assert_array_equal(proposal.twist, np.zeros(len(arrays[1])))
    assert not proposal.guiding_vector.any() and not any(array.any() for array in arrays)
