"""Turning to look, of robots whose lidars do not see all around."""

import dataclasses
import math

import numpy as np
import pytest

from drake_starnav.lidar.laser_scan import LaserScan
from drake_starnav.planning import PlannerInput, PlannerParameters, PlannerState
from drake_starnav.planning.closures import add_latest_node
from drake_starnav.planning.looking import LOOKS_AFTER, STILL_TURNS, sees_exit_after_turn, turn_to_look
from drake_starnav.planning.monitoring import is_facing
from drake_starnav.planning.state import Route
from tests.helpers.scans import RADIUS, planner_input

PARAMETERS = PlannerParameters()


def inputs(time: float, unseen: tuple[float, float] | None, yaw: float = 0.0) -> PlannerInput:
    """A robot in the open that has not seen what is between two bearings in B, rad, but for 0.4 m; None: a centred
    lidar's scan."""
    bearing, free = 2.0 * math.pi / 720 * np.arange(720) - math.pi, None
    ranges = np.full(720, math.inf)
    if unseen is not None:
        lost = (bearing > unseen[0]) & (bearing < unseen[1])
        ranges[lost], free = math.nan, np.where(lost, 0.4, 5.0)
    scan = LaserScan(time, -math.pi, 2.0 * math.pi / 720, 0.0, 5.0, ranges, lost_beams=True, free=free)
    return planner_input(scan, (0.0, 0.0, yaw), (9.0, 0.0))


def planned(given: PlannerInput) -> PlannerState:
    """With a node and a path straight ahead."""
    state = add_latest_node(PlannerState.initial(PARAMETERS, RADIUS), given)
    return dataclasses.replace(state, route=Route(np.array(((2.0, 0.0),))), recent_observations=(given.observation,))


def turns(state: PlannerState) -> bool:
    """Whether the robot turns to what it has not seen."""
    return math.isfinite(state.progress.looking_heading)


def moved_at(state: PlannerState, time: float) -> PlannerState:
    """The state of a robot that has made progress at a time, s."""
    return dataclasses.replace(state, progress=state.progress._replace(time=time))


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_a_robot_that_stands_before_its_path_turns_to_what_it_has_not_seen_beside_it(side: float) -> None:
    unseen = (0.8, 1.5) if side > 0.0 else (-1.5, -0.8)
    state = planned(inputs(0.0, unseen))
    assert not turns(turn_to_look(state, inputs(0.3, unseen)))  # it may just set off
    looked = turn_to_look(state, inputs(LOOKS_AFTER + 0.1, unseen)).guidance
    ((x, y, yaw, gear),) = looked.poses
    assert (x, y, gear) == (0.0, 0.0, 0.0) and yaw == pytest.approx(1.5 * side, abs=0.01)


@pytest.mark.parametrize("yaw", [0.0, 0.7, -1.2])
def test_it_looks_once_it_has_turned_as_far_as_it_can(yaw: float) -> None:
    """A free heading may be far off the path; turning there is not broken off, unless it takes too long."""
    unseen = (0.8 - yaw, 1.5 - yaw)
    standing = [inputs(time, unseen, yaw).observation for time in (0.0, 0.05)]
    turning = [inputs(time, unseen, yaw - time).observation for time in (0.0, 0.05)]
    for seen, looks in ((standing, LOOKS_AFTER), (turning, STILL_TURNS if yaw == 0.0 else math.inf)):
        state = dataclasses.replace(planned(inputs(0.0, unseen, yaw)), recent_observations=tuple(seen))
        for time in (0.3, LOOKS_AFTER + 0.1, STILL_TURNS + 0.1):
            state = turn_to_look(state, inputs(time, unseen, yaw))
            assert turns(state) == (time > looks)


def test_it_does_not_where_all_is_seen_or_hidden_from_there_or_behind_it() -> None:
    for unseen in (None, (-0.05, 0.05), (2.0, 3.0)):
        state = planned(inputs(0.0, unseen))
        assert not turns(turn_to_look(state, inputs(2.0, unseen)))
    moved = moved_at(planned(inputs(0.0, (0.8, 1.5))), 2.0)
    after = turn_to_look(moved, inputs(2.0, (0.8, 1.5)))
    assert not turns(after) and after.progress.standing_since == 2.0


def test_facing_and_seeing_the_probe_after_a_turn() -> None:
    given = inputs(0.0, (1.0, 2.0))
    assert is_facing(given, np.array((1.0, 0.3))) and not is_facing(given, np.array((-1.0, 0.0)))
    state = dataclasses.replace(
        planned(given), route=Route(np.array(((2.0, 0.0),)), np.array(((0.0, 0.0), (0.0, 1.0))))
    )
    for yaw, unseen, due in ((0.0, (3.0, 3.1), False), (1.0, (3.0, 3.1), True), (1.0, (0.3, 0.8), False)):
        turned = inputs(1.0, unseen, yaw)
        assert turned.observation.region is not None
        assert sees_exit_after_turn(state, turned.observation.region, turned) == due


def blind_behind(time: float, yaw: float) -> PlannerInput:
    """A lidar on the axis that looks 123 degrees to both sides, in the open."""
    half = math.radians(123.0)
    scan = LaserScan(time, -half, half / 180, 0.0, 5.0, np.full(361, math.inf))
    return planner_input(scan, (0.0, 0.0, yaw), (9.0, 0.0))


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_a_lidar_that_looks_ahead_is_turned_to_a_path_behind_it_until_it_faces_it(side: float) -> None:
    """A holonomic base would turn its back to it for good."""
    state = planned(blind_behind(0.0, side * math.pi))
    for time, yaw, looks in ((0.3, 3.1, False), (LOOKS_AFTER + 0.1, 3.1, True), (1.0, 1.2, True), (2.0, 0.4, False)):
        state = turn_to_look(state, blind_behind(time, side * yaw))
        assert turns(state) == looks
        assert not looks or abs(math.remainder(state.progress.looking_heading, 2.0 * math.pi)) < 1e-9
    assert not turns(turn_to_look(state, blind_behind(9.0, side * 2.0)))  # it sees its path


def test_it_is_not_while_the_robot_gets_on() -> None:
    state = moved_at(planned(blind_behind(0.0, math.pi)), 2.0)
    assert not turns(turn_to_look(state, blind_behind(2.1, math.pi)))
