"""Where exactly parameters are refused with which a certificate would not be worth its name."""

import dataclasses
import math
from contextlib import nullcontext

import pytest

from drake_starnav.errors import StarnavError
from drake_starnav.lidar.mounts import Mount
from drake_starnav.navigation.validation import check_and_derive_margins, check_interface, check_start
from drake_starnav.scenario.margins import derive_margins
from drake_starnav.scenario.scenario_file import load_scenario
from drake_starnav.scenario.schema import Scenario
from drake_starnav.station.navigation_station import NavigationStation
from drake_starnav.station.robot_geometry import TOLERANCE
from drake_starnav.worlds.world import World

ROOM = load_scenario("room")


def check(*overrides: str, refused: str = "") -> None:
    """The room with some overrides is accepted, or refused in these words."""
    scenario = load_scenario("room", overrides=overrides)
    with pytest.raises(StarnavError, match=refused) if refused else nullcontext():
        check_and_derive_margins(scenario)


@pytest.mark.parametrize(
    ("changes", "blind"),
    [
        ([], 0.05),
        (["lidar.delay=0.1"], 0.05 + 0.1),
        (["lidar.rate=5"], 0.2),
        (["controller.rate=10"], 0.05),
        (["drive.delay=0.02"], 0.05 + 0.02),
        (["lidar.scan_loss=0.1"], 3 * 0.05),
        (["lidar.rolling=true"], 2 * 0.05),
    ],
)
def test_the_lidar_sees_what_moves_before_it_meets_the_robot(changes, blind) -> None:
    """From full speed it stops in 0.8 s, on 0.32 m, once a command knows a scan; both move until then."""
    common = ["obstacles.max_speed=0.6", *changes]
    scenario = load_scenario("room", overrides=common)
    blind += 1.0 / scenario.controller.rate + scenario.simulation.time_step
    needed = scenario.robot.radius + derive_margins(scenario).preferred + 0.8 * blind + 0.32 + 0.6 * (blind + 0.8)
    check(*common, f"lidar.range_max={needed + 1e-6}")
    check(*common, f"lidar.range_max={needed - 1e-6}", refused=f"allowed: at least {needed:.3g} m")


def test_a_masked_sector_is_a_gap_between_two_beams() -> None:
    masked = load_scenario("room", overrides=["lidar.mask=[[1.0, 1.05]]"])
    assert check_and_derive_margins(masked).safety > check_and_derive_margins(ROOM).safety
    words = r"lidar\.mask is \[\[1\.0, 1\.5\]\]: at .*, or angle_min and angle_max"
    check("lidar.mask=[[1.0, 1.5]]", refused=words)


@pytest.mark.parametrize(("larger", "fits"), [(0.5 * TOLERANCE, True), (2.0 * TOLERANCE, False)])
def test_all_of_the_robot_is_within_its_radius(larger: float, fits: bool) -> None:
    robot = dataclasses.replace(ROOM.robot, radius=ROOM.robot.radius + larger)
    station = NavigationStation(World("open", (0, 0, 0), (5, 0)), Scenario("test", None, robot, ROOM.lidar))
    words = "allowed: a footprint that holds all of it, folded as"
    with nullcontext() if fits else pytest.raises(StarnavError, match=words):
        check_interface(ROOM, station)


@pytest.mark.parametrize("beams, speed, fits", [(36, 0.8, False), (36, 3.0, True), (90, 3.0, False), (360, 3.0, False)])
def test_a_robot_that_fits_between_two_beams_where_it_must_stop_is_refused(beams, speed, fits):
    words = f"lidar.beams is {beams}: at [0-9.]+ m, .* at most robot.radius" if fits else ""
    check(f"lidar.beams={beams}", f"robot.max_speed={speed}", refused=words)


def test_what_a_base_does_not_have_is_refused() -> None:
    scenario = load_scenario("forest", overrides=["robot.model=omnibot", "drive.slip=0.05"])
    with pytest.raises(StarnavError, match="drive.slip is 0.05 .* without wheels; allowed: 0, and drive.error"):
        check_and_derive_margins(scenario)


CAR = ["robot.model=carbot", "robot.footprint=[[0.48, 0.15], [-0.12, 0.15], [-0.12, -0.15], [0.48, -0.15]]"]


@pytest.mark.parametrize("length, least", [(0.2, 0.2), (2.0, 0.5 * math.hypot(1.0, 0.15))])
def test_cars_of_circles_tighter_than_the_rollout_is_proved_for_are_refused(length: float, least: float) -> None:
    """Than 0.2 m, or than half of what the robot reaches from its axis."""
    x = 0.5 * length
    body = f"robot.footprint=[[{x}, 0.15], [{-x}, 0.15], [{-x}, -0.15], [{x}, -0.15]]"
    slow = ["robot.max_yaw_rate=2", "robot.max_speed=0.2", "robot.max_yaw_acceleration=0.5"]
    common = [CAR[0], body, *slow]
    check(*common, f"robot.least_radius={least + 1e-9}")
    words = rf"robot.least_radius is {least - 1e-3:.3g} m.*at least {least:.3g} m"
    check(*common, f"robot.least_radius={least - 1e-3}", refused=words)


def test_a_car_whose_turning_rate_keeps_it_on_wider_circles_may_steer_further() -> None:
    check(*CAR, "robot.least_radius=0.1")


@pytest.mark.parametrize("changes, most", [([], 6.4), (["robot.max_yaw_rate=1"], 4.0), (["robot.max_speed=0.4"], 3.2)])
def test_cars_that_steer_quicker_from_lock_to_lock_than_the_rollout_is_proved_for_are_refused(changes, most) -> None:
    """In less than 0.5 s: at full speed that changes the turning rate by twice the largest one."""
    common = [*CAR, *changes]
    check(*common, f"robot.max_yaw_acceleration={most - 1e-9}")
    words = rf"robot.max_yaw_acceleration is {most + 0.1:.3g} .*at most {most:.3g} "
    check(*common, f"robot.max_yaw_acceleration={most + 0.1}", refused=words)


@pytest.mark.parametrize(
    ("radius", "tolerance", "jump", "least"),
    [(0.25, 0.01, 0.0, "0.02"), (0.25, 0.021, 0.0, ""), (0.25, 0.1, 0.2, "0.22"), (0.5, 0.021, 0.0, "0.04")],
)
def test_a_tolerance_within_which_the_robot_does_not_come_is_refused(radius, tolerance, jump, least: str) -> None:
    changes = [f"robot.radius={radius}", f"simulation.goal_tolerance={tolerance}", f"localization.jump={jump}"]
    check(*changes, refused=f"goal_tolerance is {tolerance:g} m; allowed: more than {least} m" if least else "")


@pytest.mark.parametrize(
    ("post", "overrides", "unseen"),
    [
        ((0.0, 0.32), ("180", 0.2), True),
        ((0.0, 0.37), ("180", 0.2), False),  # beyond what it takes for free
        ((0.3, 0.0), ("180", 0.2), False),  # seen
        ((0.0, 0.32), ("360", 0.2), False),  # all around
    ],
)
def test_nothing_stands_unseen_in_the_disc_in_which_a_robot_begins(post, overrides, unseen: bool) -> None:
    view, ahead = overrides
    half = math.radians(0.5 * float(view))
    limited = ["lidar.beams=181", f"lidar.angle_min={-half}", f"lidar.angle_max={half}"] if view == "180" else []
    scenario, mounts = load_scenario("room", overrides=limited), (Mount(ahead, 0.0, 0.0, False),)
    world = World("post", (1.0, 2.0, 0.0), (5, 2), cylinders=[(1.0 + post[0], 2.0 + post[1], 0.02)])
    margin = check_and_derive_margins(scenario, mounts).safety
    words = r"is 0.30 m from the start of world post, .*; allowed: nothing nearer than"
    with pytest.raises(StarnavError, match=words) if unseen else nullcontext():
        check_start(world, scenario, mounts, margin)
