"""Whole trials: outcomes, determinism, and what is left behind."""

import dataclasses
import json
import math

import numpy as np
import pytest
from pydrake.systems.framework import LeafSystem

from drake_starnav.errors import StarnavError, UnsupportedError
from drake_starnav.geometry.polyline import measure_segment_distance
from drake_starnav.navigation import Parts
from drake_starnav.scenario.scenario_file import load_scenario, parse_scenario
from drake_starnav.scenario.shipped import METHODS
from drake_starnav.simulation import run as run_module
from drake_starnav.simulation.run import run_trial
from drake_starnav.simulation.trial import make_trial_record
from drake_starnav.station.monitors import CollisionMonitor
from drake_starnav.systems.twist_shield import Unshielded
from drake_starnav.worlds import World, make_world
from drake_starnav.worlds.moving_obstacles import MovingObstacles

SMALL = "world: !Obstacles {bounds: [-1, -2, 5, 2], cylinders: [[1.7, 0.1, 0.4]], goal: [3.5, 0.0]}\n"
"""A robot whose lidar sees no farther than its own hull, behind no shield."""


@pytest.fixture(scope="module")
def small_trial():
    return run_trial(parse_scenario(SMALL, name="small"), seed=3)


def test_robot_arrives_around_an_obstacle(small_trial) -> None:
    assert small_trial.outcome == "reached"
    assert small_trial.min_clearance_m > 0.0
    assert small_trial.time_s < 15.0
    # the trial ends within the goal's tolerance, so the driven path may be shorter than the whole way
    assert small_trial.shortest_path_m - 0.35 < small_trial.path_length_m < 1.3 * small_trial.shortest_path_m
    assert small_trial.mean_speed_mps == pytest.approx(small_trial.path_length_m / small_trial.time_s)
    assert small_trial.nodes >= 1
    assert small_trial.min_clearance_m < small_trial.mean_clearance_m < 2.0
    # the robot drove at its mean speed at least, and at its largest at most
    least, most = small_trial.mean_speed_mps**2 * small_trial.time_s, (0.8**2 + 0.5 * 0.5**2) * small_trial.time_s
    assert least < small_trial.twist_energy_m2ps < most
    assert 0.0 < small_trial.jerk_mps3 < 1.0 / 0.1  # the acceleration changes by at most 1 m/s^2 each way per window
    assert small_trial.stops == 0
    assert small_trial.stuck_s == 0.0
    for step in ("command", "scan", "plan"):
        times = getattr(small_trial, step)
        assert times["count"] > 0
        assert 0.0 < times["p50_s"] <= times["p99_s"]


def test_the_record_has_the_tightest_gap_and_the_path_that_was_driven(small_trial) -> None:
    class Follow:
        def add_to(self, builder, navigation, scenario) -> None: ...

        def finish(self, lines, motion) -> None:
            self.poses = motion.poses

    assert small_trial.tightest_gap_m == pytest.approx(1.7, rel=5e-3)  # from the obstacle to the wall
    follow = Follow()
    path = np.array(run_trial(parse_scenario(SMALL, name="small"), seed=3, observer=follow).path)
    away = [measure_segment_distance(follow.poses[:, :2], a, b) for a, b in zip(path[:-1], path[1:], strict=True)]
    assert np.min(away, axis=0).max() <= 0.021
    assert 3 <= len(path) < 40


def test_a_world_of_ones_own_is_driven_in(small_trial) -> None:
    scenario = parse_scenario(SMALL, name="small")
    world = make_world(scenario.world, 3, scenario.robot.radius)
    again = run_trial(load_scenario("forest"), Parts(world), seed=3)
    assert again.state_hash == small_trial.state_hash
    farther = run_trial(scenario, Parts(world=dataclasses.replace(world, goal=(3.9, 0.0))), seed=3)
    assert farther.straight_line_m == pytest.approx(3.9)
    assert farther.path_length_m > small_trial.path_length_m


def test_a_controller_of_ones_own_is_tried_recorded_and_logged(tmp_path) -> None:
    class Ahead(LeafSystem):
        def __init__(self) -> None:
            super().__init__()
            self.DeclareVectorOutputPort("desired_twist", 2, lambda context, output: output.SetFromVector([0.5, 0.0]))

    scenario, html, csv = (
        parse_scenario(SMALL + "simulation: {timeout: 6}\n", name="small"),
        str(tmp_path / "a.html"),
        str(tmp_path / "a.csv"),
    )
    free = Unshielded(scenario.robot, scenario.controller)
    trial = run_trial(scenario, Parts(controller=Ahead(), shield=free), seed=3, html=html, csv=csv)
    assert (trial.method, trial.outcome) == ("Ahead", "collision")
    table = np.genfromtxt(csv, delimiter=",", names=True)
    assert table.dtype.names == ("t", "x", "y", "yaw", "v", "omega", "clearance")
    assert table["t"][-1] == pytest.approx(trial.time_s)
    assert table["x"][-1] == pytest.approx(trial.path[-1][0], abs=1e-3)
    assert "method Ahead" in (tmp_path / "a.html").read_text(encoding="utf-8")
    assert run_trial(scenario, Parts(controller=Ahead()), seed=3, observer=None).min_clearance_m > 0.0


def test_a_trial_goes_by_the_name_of_its_method() -> None:
    with pytest.raises(StarnavError, match="the scenario was loaded with star; allowed: that"):
        run_trial(parse_scenario(SMALL, name="small"), method="dwa")


def door(left: float) -> str:
    """A world with a door 0.2 m deep, not straight ahead, that leaves the robot so much on each side, m."""
    half = 0.25 + left
    posts = [[[1.9, side * half], [2.1, side * half], [2.1, side * 1.9], [1.9, side * 1.9]] for side in (-1, 1)]
    return f"world: !Obstacles {{bounds: [-1, -1.9, 5, 1.9], polygons: {posts}, start: [0, 0.6, 0], goal: [4, -0.4]}}\n"


@pytest.mark.parametrize(
    "left, settings", [(0.03, ""), (0.015, "lidar: {noise: 0.001, beams: 720}"), (0.1, "lidar: {noise: 0.05}")]
)
def test_doors_are_passed_that_leave_a_little_more_than_the_margin(left, settings) -> None:
    trial = run_trial(parse_scenario(door(left) + settings, name="door"), seed=5)
    assert trial.outcome == "reached"
    assert trial.min_clearance_m > 0.005


def test_a_fence_of_thin_posts_is_passed_without_a_stop() -> None:
    # from afar no beam hits the posts, so that the first regions reach through them
    posts = [(5.0 + 0.5 * (k % 2), y, 0.02) for k, y in enumerate(np.arange(-2.6, 2.7, 0.8))]
    world = World("fence", (0.0, 0.3, 0.0), (7.5, -0.2), cylinders=np.array(posts), bounds=(-1.0, -3.0, 8.5, 3.0))
    trial = run_trial(parse_scenario("world: !Forest {}\n", name="fence"), Parts(world))
    assert trial.outcome == "reached"
    assert trial.min_clearance_m > 0.01
    assert trial.stuck_s == 0.0
    assert trial.time_s < 13.0


def test_the_memory_of_geometries_is_given_back() -> None:
    class Keep:
        def add_to(self, builder, navigation, scenario) -> None:
            self.inspector = navigation.station.scene_graph.model_inspector()
            assert self.inspector.num_geometries() > 5

        def finish(self, lines, motion) -> None: ...

    keep = Keep()
    run_trial(parse_scenario(SMALL + "simulation: {timeout: 0.1}\n", name="small"), seed=3, observer=keep)
    assert keep.inspector.num_geometries() == 0


def test_same_seed_same_trajectory_other_seed_other(small_trial) -> None:
    scenario = parse_scenario(SMALL, name="small")
    assert run_trial(scenario, seed=3).state_hash == small_trial.state_hash
    assert run_trial(scenario, seed=4).state_hash != small_trial.state_hash


@pytest.mark.slow
@pytest.mark.parametrize(("first", "last"), [(0.0, 6.28), (6.28319, 0.0), (0.7, 6.9745)])
def test_a_robot_drives_wherever_the_seam_of_its_lidar_lies(first: float, last: float) -> None:
    text = "world: !Obstacles {cylinders: [[1.0, 0.9, 0.3]], goal: [1.5, 0.0], bounds: [-1, -2, 4, 2]}"
    scenario = parse_scenario(text, name="seam", overrides=[f"lidar.angle_min={first}", f"lidar.angle_max={last}"])
    assert run_trial(scenario).outcome == "reached"


@pytest.mark.parametrize("seed", [1000, 1001])
def test_a_first_scan_full_of_strays_is_no_reason_to_give_up(seed: int) -> None:
    scenario = load_scenario("maze", overrides=["lidar.outliers=0.5", "simulation.timeout=3"])
    assert run_trial(scenario, seed=seed).outcome == "timeout"


def test_walled_in_goal_is_unreachable_and_the_robot_stands() -> None:
    square = [[3.0, -0.8], [4.6, -0.8], [4.6, 0.8], [3.0, 0.8]]
    walls = []
    for k in range(4):
        a, b = np.array(square[k]), np.array(square[(k + 1) % 4])
        normal = 0.05 * np.array([a[1] - b[1], b[0] - a[0]]) / np.hypot(*(b - a))
        along = 0.05 * (b - a) / np.hypot(*(b - a))
        walls.append(
            [(p).tolist() for p in (a - along - normal, b + along - normal, b + along + normal, a - along + normal)]
        )
    text = f"world: !Obstacles {{bounds: [-1, -2, 6, 2], polygons: {walls}, goal: [3.8, 0.0]}}"
    trial = run_trial(parse_scenario(text, name="walled"), seed=0)
    assert trial.outcome == "unreachable"
    assert trial.shortest_path_m is None
    assert trial.min_clearance_m > 0.0
    json.dumps(make_trial_record(trial), allow_nan=False)


@pytest.mark.parametrize(
    ("cylinders", "lidar", "reason"),
    [
        (
            [[0.34 * math.cos(a), 0.34 * math.sin(a), 0.08] for a in np.radians(np.arange(0, 360, 20))],
            "",
            "too near: a h",
        ),
        ([], "lidar: {dropout: 1.0}", "blind: no scan that measures anything has arrived for"),
    ],
)
def test_a_robot_that_never_moves_says_why_within_seconds(cylinders: list, lidar: str, reason: str) -> None:
    text = (
        f"world: !Obstacles {{bounds: [-1, -2, 5, 2], cylinders: {np.round(cylinders, 4).tolist()}, goal: [3.5, 0]}}\n"
    )
    trial = run_trial(parse_scenario(f"{text}{lidar}\nsimulation: {{timeout: 7.0}}", name="stuck"), seed=0)
    assert trial.outcome == "blocked" and trial.time_s == pytest.approx(7.0) and trial.min_clearance_m > 0.0
    assert trial.blocked_s is not None and trial.blocked_s <= 5.0
    assert trial.blocked_by is not None and trial.blocked_by.startswith(reason)
    json.dumps(make_trial_record(trial), allow_nan=False)


@pytest.mark.parametrize(("beside", "outcome"), [(0.0, "occupied"), (0.26, "occupied"), (0.27, "timeout")])
def test_a_goal_that_something_stands_on_is_said_to_be_occupied(beside: float, outcome: str) -> None:
    """Up to there, no place within the tolerance of 0.3 m has room for a robot of 0.25 m and its margin of 14.5 mm."""
    stands = np.array([(0.0, 3.0 + beside, 0.0), (100.0, 3.0 + beside, 0.0)])
    parked = MovingObstacles(np.array([0.3]), (stands,))
    world = World("parked", (0, 0, 0), (3, 0), bounds=(-1, -2, 6, 2), timeout=1.0, moving_obstacles=parked)
    scenario = parse_scenario("world: !Room {}\nobstacles: {max_speed: 0.5}", name="parked")
    assert run_trial(scenario, Parts(world)).outcome == outcome


@pytest.mark.parametrize("judge", ["AddToBuilder", "compute_body_clearance"])
def test_contact_and_clearance_are_each_enough_for_a_collision(judge: str, monkeypatch) -> None:
    blind = {
        "AddToBuilder": (CollisionMonitor, staticmethod(lambda builder, station: None)),
        "compute_body_clearance": (run_module, lambda world, poses, footprint: np.full(len(poses), 9.0)),
    }
    module, substitute = blind[judge]
    monkeypatch.setattr(module, judge, substitute)
    text = "world: !Obstacles {cylinders: [[0.6, 0.0, 0.1]], goal: [2.0, 0.0]}\nsimulation: {timeout: 3.0}\n"
    text += "lidar: {range_max: 0.2}\n"
    trial = run_trial(parse_scenario(text, name="blind", method="foa"), seed=0)
    assert trial.outcome == "collision"
    assert (trial.min_clearance_m < 0.0) == (judge != "compute_body_clearance") == (trial.time_s == 3.0)


def test_an_empty_world_has_a_record_without_infinities() -> None:
    trial = run_trial(parse_scenario("world: !Obstacles {goal: [2.0, 0.0]}", name="empty"), seed=0)
    assert trial.outcome == "reached"
    record = make_trial_record(trial)
    assert record["min_clearance_m"] is record["mean_clearance_m"] is None
    assert set(record) == {field.name for field in dataclasses.fields(trial)}
    json.dumps(record, allow_nan=False)


@pytest.mark.parametrize("method", [name for name in METHODS if not name.startswith("star")])
def test_baselines_drive_around_an_obstacle(method: str) -> None:
    scenario = parse_scenario(SMALL.replace("1.7, 0.1, 0.4", "1.7, 0.6, 0.3"), name="small", method=method)
    trial = run_trial(scenario, method=method, seed=3)
    assert trial.outcome == "reached"
    assert trial.min_clearance_m > 0.0
    assert trial.command["count"] > 0
    planned = method == "foa_roadmap"
    assert (trial.nodes > 0) == (trial.plan["count"] > 0) == planned
    assert trial.state_hash == run_trial(scenario, method=method, seed=3).state_hash


def test_walls_are_known_to_dsm_and_polygons_are_not() -> None:
    scenario = parse_scenario(
        "world: !Obstacles {polygons: [[[2, 1], [3, 1], [3, 2]]], goal: [4.0, 0.0]}", name="walls", method="dsm"
    )
    with pytest.raises(UnsupportedError, match=r"circles in world obstacles, which has 1 polygon; allowed"):
        run_trial(scenario, method="dsm")
