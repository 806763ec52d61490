"""The planner through a context: what it says, when, and that the context owns all it knows."""

import dataclasses

import numpy as np
import pytest

from drake_starnav.errors import StarnavError
from drake_starnav.lidar.sensor_model import LidarParameters
from drake_starnav.planning import PlannerParameters, PlannerStatus
from drake_starnav.robot import RobotParameters
from drake_starnav.safety import KeepOut
from drake_starnav.surroundings import Observation
from drake_starnav.systems.star_roadmap_planner import STANDSTILL, StarRoadmapPlanner
from drake_starnav.worlds.world import World
from tests.helpers.alone import Alone
from tests.helpers.scans import MARGINS, cast, observe_scan, observed

ROBOT, PARAMETERS = RobotParameters(), PlannerParameters()
LIDAR = LidarParameters()
PERIOD = 1.0 / LIDAR.rate
POSE = np.array([0.3, -0.1, 0.5])
OPEN = World("open", (0, 0, 0), (0, 0), bounds=(-2.0, -3.0, 8.0, 3.0))
SCREEN = World(
    "screen", (0, 0, 0), (0, 0), polygons=([(1.5, -1.0), (1.7, -1.0), (1.7, 1.0), (1.5, 1.0)],), bounds=OPEN.bounds
)
IN_SIGHT, BEHIND = np.array([2.5, 0.4]), np.array([4.0, 0.0])


class Planning(Alone):
    """A planner."""

    def __init__(self, goal: np.ndarray = BEHIND, **options) -> None:
        system = StarRoadmapPlanner(ROBOT, PARAMETERS, MARGINS, **options)
        super().__init__(system, observation=Observation.none(), pose=POSE, goal=goal)

    def see(self, world: World, pose: np.ndarray = POSE) -> None:
        """Stand at a pose and put what is seen from there before the next update."""
        scan = dataclasses.replace(cast(world, pose), time=self.context.get_time())
        self.put("observation", observed(scan, pose))
        self.put("pose", pose)

    def update(self) -> None:
        self.advance(PERIOD)


def test_ports() -> None:
    system = Planning().system
    inputs = [system.get_input_port(k).get_name() for k in range(system.num_input_ports())]
    assert inputs == ["observation", "pose", "goal", "heading", "surroundings"]
    outputs = [system.get_output_port(k).get_name() for k in range(system.num_output_ports())]
    assert outputs == ["guidance", "short_term_goal", "planner_state", "status", "blocked_by"]
    assert system.GetOutputPort("short_term_goal").size() == 2
    everywhere, short_term_goal, told = range(5), 1, (3, 4)
    reaches = everywhere, [short_term_goal, *told], everywhere, everywhere, told
    for port, reached in enumerate(reaches):
        for out in everywhere:
            assert system.HasDirectFeedthrough(port, out) == (out in reached)


def standing(planning: Planning, world: World | None, seconds: float, pose: np.ndarray = POSE) -> None:
    """Stand at a pose for some time, and see the world, if any, from there."""
    for _ in range(round(seconds / PERIOD)):
        if world is not None:
            planning.see(world, pose)
        planning.update()


def test_a_robot_that_stands_still_is_blocked_until_it_moves() -> None:
    planning = Planning()
    standing(planning, SCREEN, STANDSTILL - 0.1)
    assert planning.out("status") is PlannerStatus.EXPLORING and planning.out("blocked_by") == ""
    standing(planning, SCREEN, 0.2)
    assert planning.out("status") is PlannerStatus.BLOCKED
    assert planning.out("blocked_by").startswith("nothing that is seen")
    planning.see(SCREEN, POSE + (0.1, 0.0, 0.0))
    assert planning.out("status") is PlannerStatus.EXPLORING and planning.out("blocked_by") == ""


def test_a_certificate_that_knows_of_nothing_is_named() -> None:
    planning = Planning()
    planning.put("surroundings", observe_scan(cast(SCREEN, POSE), POSE, ROBOT.radius + 0.0145, 1.2))
    standing(planning, SCREEN, STANDSTILL + 0.1)
    assert planning.out("blocked_by").startswith("nothing that the certificate knows")


@pytest.mark.parametrize(("ahead", "said"), [(0.28, "too near: dock"), (0.5, "nothing that is seen")])
def test_the_area_that_holds_a_robot_is_named(ahead: float, said: str) -> None:
    dock = KeepOut(POSE[:2] + (ahead, 0.0) + np.array([(0.0, -0.3), (0.3, -0.3), (0.3, 0.3), (0.0, 0.3)]), name="dock")
    planning = Planning(keep_outs=[dock])
    standing(planning, SCREEN, STANDSTILL + 0.1)
    assert planning.out("blocked_by").startswith(said)


def test_at_the_goal_a_robot_may_stand() -> None:
    planning = Planning(goal=POSE[:2])
    standing(planning, OPEN, STANDSTILL + 0.1)
    assert planning.out("status") is PlannerStatus.APPROACHING and planning.out("blocked_by") == ""


def test_waits_where_it_is_until_something_is_seen() -> None:
    planning = Planning()
    planning.simulator.Initialize()
    for _ in range(3):
        assert planning.out("status") is PlannerStatus.WAITING
        assert planning.out("short_term_goal") == pytest.approx(POSE[:2])
        assert len(planning.out("guidance").path) == 0
        assert len(planning.out("planner_state").roadmap) == 0
        planning.update()


def test_a_goal_that_is_no_place_is_reported() -> None:
    for goal, words in (([np.nan, 0.0], "allowed: finite x and y"), ([1e7, 0.0], "too far")):
        planning = Planning(goal=np.array(goal))
        planning.see(SCREEN)
        with pytest.raises(StarnavError, match=words):
            planning.update()


def test_a_scan_is_planned_with_at_once_and_once() -> None:
    planning = Planning(goal=IN_SIGHT)
    planning.see(OPEN)
    first = planning.out("planner_state")
    assert first.status is PlannerStatus.APPROACHING
    planning.put("goal", IN_SIGHT)  # the same goal, on a port that changed
    assert planning.out("planner_state") is first
    planning.update()  # the state takes it over
    assert planning.out("planner_state") is first


def test_a_pause_of_the_sensor_is_no_stall() -> None:
    for pause, nodes in ((0.4, 1), (0.6, 1), (1.2, 1)):
        planning = Planning(goal=BEHIND)
        planning.see(SCREEN)
        planning.update()
        planning.simulator.AdvanceTo(pause * PARAMETERS.progress_timeout)
        planning.see(SCREEN)
        planning.update()
        assert len(planning.out("planner_state").roadmap) == nodes, pause


def test_a_moved_goal_is_taken_up_at_once() -> None:
    planning = Planning(goal=IN_SIGHT)
    planning.see(OPEN)
    planning.update()
    moved = np.array([-1.0, 1.0])
    planning.put("goal", moved)
    assert planning.out("guidance").path[-1] == pytest.approx(moved)
    assert len(planning.out("planner_state").roadmap) == 1
