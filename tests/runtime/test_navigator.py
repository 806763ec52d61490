"""What a navigator makes of drivers: it drives to the goal, and whatever goes wrong, the robot soon stands."""

import dataclasses
import math

import numpy as np
import pytest
from pydrake.systems.framework import DiagramBuilder, LeafSystem

from drake_starnav import Parts, StarnavError, World, load_scenario, parse_scenario
from drake_starnav.runtime import Navigator, Odometry
from drake_starnav.worlds.view import scan_from
from tests.helpers.bare_robot import EPOCH, BareRobot, Slipping, TwoEyes
from tests.helpers.driver_faults import BEGIN, FAULTS, HARMLESS, SLOWER, Faults, Harmless, driven

FOREST = load_scenario("forest")
BRAKING = 0.5 * FOREST.robot.max_speed**2 / FOREST.robot.max_acceleration
replace = dataclasses.replace


@pytest.fixture(scope="module")
def made() -> Navigator:
    return Navigator(FOREST, warm=False)


@pytest.fixture
def forest(made) -> Navigator:
    """A navigator of the forest that knows of nothing yet."""
    made.reset()
    return made


@pytest.fixture
def robot() -> BareRobot:
    return BareRobot(FOREST)


@pytest.mark.parametrize("kind", FAULTS)
def test_what_goes_wrong_stops_the_robot(forest, robot, kind) -> None:
    fault, within = getattr(Faults(), kind), SLOWER.get(kind, 1.0)
    driven(forest, robot, BEGIN)
    assert robot.speed > 0.7
    way = robot.way
    commands = driven(forest, robot, BEGIN + within + 0.02, fault)
    assert robot.stands and commands[-1].status == "standing" and commands[-1].why
    assert robot.way - way < BRAKING + FOREST.robot.max_speed * (within - 0.8 + 0.02)
    commands = driven(forest, robot, BEGIN + within + 1.0, fault)  # and stays so
    assert robot.stands and robot.clearance > 0.0


@pytest.mark.parametrize("kind", HARMLESS)
def test_what_does_no_harm_does_not_stop_it(forest, robot, kind) -> None:
    commands = driven(forest, robot, BEGIN + 2.0, getattr(Harmless(), kind))
    assert commands[-1].status == "driving" and robot.way > 1.5 and robot.clearance > 0.0


def beam_at(beam, value):
    """A fault of drivers: one beam of every scan has always the same range."""

    def spoilt(scan):
        return replace(scan, ranges=np.where(np.arange(len(scan.ranges)) == beam, value, scan.ranges))

    return lambda reading, time: reading._replace(scans=[spoilt(scan) for scan in reading.scans])


@pytest.mark.parametrize("value", [-math.inf, 0.15])
def test_one_beam_that_errs_for_good_holds_no_robot_and_is_named(forest, robot, value) -> None:
    commands = driven(forest, robot, 3.0, beam_at(100, value), begin=0.0)
    assert commands[-1].status == "driving" and robot.way > 1.5 and robot.clearance > 0.0
    ((named, count),) = forest.intake.drop_counts
    assert "beam 100 of lidar 0" in named and count == robot.scans


def test_a_beam_that_errs_for_good_ahead_of_the_robot_is_found_out_and_named(forest, robot) -> None:
    beam = 180
    commands = driven(forest, robot, 30.0, beam_at(beam, 0.6), begin=0.0)
    assert commands[-1].status == "driving" and robot.way > 4.0 and robot.clearance > 0.0
    assert any(command.why.startswith(f"beam {beam} errs: it alone hits") for command in commands)
    assert dict(forest.intake.drop_counts)[f"hits of beam {beam} alone, wherever the robot turned"] == 1


def test_scans_whose_number_of_beams_varies_are_driven_by(forest, robot) -> None:
    def varying(reading, time):
        scans = [
            replace(scan, ranges=np.append(scan.ranges, scan.ranges[0])) if round(10.0 * time) % 2 else scan
            for scan in reading.scans
        ]
        return reading._replace(scans=scans)

    commands = driven(forest, robot, 3.0, varying, begin=0.0)
    assert not any(command.why for command in commands) and robot.way > 1.0


class Hesitating(BareRobot):
    """Does nothing from `begin` to `end`, s, whatever it is told, then it goes on; if silent, its time stands still."""

    def __init__(self, begin: float, end: float, silent: bool = False) -> None:
        super().__init__(FOREST)
        self.begin, self.end, self.silent = begin, end, silent

    @property
    def halted(self) -> bool:
        return self.begin <= self.time < self.end

    def read(self):
        reading = super().read()
        return reading._replace(scans=[], odometry=[]) if self.silent and self.halted else reading

    def drive(self, command) -> None:
        if self.silent and self.halted:
            self.twist, self.ticks = command.twist.copy(), self.ticks + 1
        else:
            super().drive(command._replace(twist=np.zeros(2)) if self.halted else command)


@pytest.mark.parametrize("seconds", [0.12, 0.5, 3.0])
def test_a_base_whose_computer_halts_is_driven_on(forest, seconds) -> None:
    robot = Hesitating(BEGIN, BEGIN + seconds, silent=True)
    commands = driven(forest, robot, BEGIN + seconds + 2.0)
    assert commands[-1].status == "driving" and robot.speed > 0.5 and robot.clearance > 0.0
    assert {command.why.rstrip("0123456789. s") for command in commands} <= {"", "no odometry for", "no scan for"}


@pytest.mark.parametrize("seconds", [0.5, 2.5])
def test_a_base_that_hesitates_is_braked_and_driven_on(forest, seconds) -> None:
    robot = Hesitating(BEGIN, BEGIN + seconds)
    commands = driven(forest, robot, BEGIN + seconds + 4.5)
    said = [command for command in commands if "not executed" in command.why]
    assert said and {command.status for command in said} <= {"braking", "standing"}
    assert commands[-1].status == "driving" and robot.speed > 0.5 and robot.clearance > 0.0


def test_a_base_that_does_nothing_for_good_stands_until_the_goal_is_given_anew(forest) -> None:
    robot = Hesitating(BEGIN, 20.0)
    commands = driven(forest, robot, 15.0)
    tries = np.flatnonzero(np.diff([command.status == "driving" for command in commands]))
    assert len(tries) <= 4  # it was tried once more
    commands = driven(forest, robot, 23.0)
    assert {command.status for command in commands} == {"standing"}
    assert commands[-1].why.endswith("until the goal is given anew")
    forest.step(*robot.read()._replace(goal=None))
    robot.ticks += 1
    commands = driven(forest, robot, 26.0)
    assert commands[-1].status == "driving" and robot.speed > 0.3


@pytest.mark.parametrize("fault", ["odometry_freezes", "odometry_stands"])
def test_odometry_that_denies_what_the_scans_see_stops_the_robot_for_good(forest, robot, fault) -> None:
    kind = getattr(Faults(), fault)
    driven(forest, robot, BEGIN)
    driven(forest, robot, BEGIN + 2.5, kind)
    assert robot.stands
    commands = driven(forest, robot, 20.0, kind)
    assert robot.stands and {command.status for command in commands} == {"standing"}
    assert commands[-1].why.endswith("until the goal is given anew")
    driven(forest, robot, 22.0)  # it is well again, but nobody has said so
    assert robot.stands


def test_hits_that_vanish_hold_a_robot_until_it_is_reset(forest, robot) -> None:
    vanish = Faults().scans_without_returns
    driven(forest, robot, 2.0 * BEGIN, vanish)
    command = driven(forest, robot, 2.0 * BEGIN + 2.0, vanish)[-1]
    assert robot.stands and "until they return, or a reset" in command.why
    forest.step(*vanish(robot.read(), 0.0)._replace(reset=True))
    robot.ticks += 1
    commands = driven(forest, robot, 2.0 * BEGIN + 3.0, vanish)
    assert commands[-1].status == "driving" and robot.speed > 0.3


@pytest.mark.parametrize("share", [0.0, 1.4])
def test_scans_and_odometry_that_disagree_for_good_are_said_to(forest, share) -> None:
    robot = Slipping(FOREST, share, BEGIN)
    commands = driven(forest, robot, 15.0)
    said = [command.why for command in commands if command.status == "standing"]
    assert any(why.startswith("scans and odometry disagree") and "given anew" not in why for why in said)
    assert said[-1].startswith("scans and odometry disagree") and said[-1].endswith("until the goal is given anew")
    tries = np.flatnonzero(np.diff([command.status == "driving" for command in commands]))
    assert len(tries) == 3  # it braked, was tried again with another map, and stands
    assert {command.status for command in commands} == {"driving", "braking", "standing"}
    robot.share = 1.0  # mended, and its goal given anew
    forest.step(*robot.read()._replace(goal=None))
    robot.ticks += 1
    assert driven(forest, robot, 18.0)[-1].status == "driving" and robot.speed > 0.3


@pytest.mark.parametrize("declared", ["drive: {slip: 0.3}", "localization: {drift: 0.3}"])
def test_a_slip_that_is_declared_is_allowed_for(declared) -> None:
    scenario = parse_scenario(f"{declared}\nrobot: {{max_speed: 0.4}}", name="slippery")
    robot = Slipping(scenario, 0.7, world=World("posts", (0.0, 0.0, 0.0), (4.0, 0.0), cylinders=POSTS))
    commands = driven(Navigator(scenario, warm=False), robot, 6.0)
    assert not any("disagree" in command.why for command in commands) and robot.way > 1.0


def test_a_pose_that_jumps_drops_the_goal_and_begins_again_with_another(forest, robot) -> None:

    def jump(r, t):
        return r._replace(odometry=[row._replace(x=row.x + 0.5) for row in r.odometry])

    commands = driven(forest, robot, 5.0, jump)
    assert any("jumps by 0.5" in command.why for command in commands)
    assert commands[-1].status == "standing" and commands[-1].why.startswith("the goal is dropped")
    x, y = robot.world.goal

    def another(r, t):
        return jump(r, t)._replace(goal=(x + 0.5, y))

    commands = driven(forest, robot, 8.0, another)
    assert commands[-1].status == "driving" and robot.clearance > 0.0


def test_after_a_gap_the_ramp_begins_at_the_measured_twist(forest, robot) -> None:
    driven(forest, robot, BEGIN)
    robot.ticks += 25
    slowed = robot.read()
    slow = slowed.odometry[0]._replace(v=0.3, omega=0.0)
    command = forest.step(*slowed._replace(odometry=[slow]))
    assert abs(command.twist[0] - 0.3) <= FOREST.robot.max_acceleration * robot.period + 1e-9


def test_a_goal_with_a_heading(forest) -> None:
    robot = BareRobot(FOREST, World("open", (0.0, 0.0, 0.0), (1.5, 0.0), cylinders=np.array([(0.8, -1.0, 0.2)])))
    commands = driven(forest, robot, 12.0, lambda r, t: r._replace(goal=(*robot.world.goal, 2.0)), begin=0.0)
    assert commands[-1].status == "reached" and robot.stands
    assert math.dist(robot.pose[:2], robot.world.goal) < FOREST.simulation.goal_tolerance
    assert abs(math.remainder(robot.pose[2] - 2.0, math.tau)) < 0.1


POSTS = np.array([(1.5, 0.3, 0.25), (3.0, -0.6, 0.3), (4.0, 0.9, 0.3)])


@pytest.mark.parametrize(
    "robot",
    [
        "",
        "footprint: [[-0.25, -0.25], [0.35, -0.25], [0.35, 0.25], [-0.25, 0.25]]",
        "base: omnidirectional, model: omnibot",
        "base: car, model: carbot",
    ],
)
def test_every_base_drives_and_brakes(robot) -> None:
    scenario = parse_scenario(f"robot: {{{robot}}}", name="robot")
    robot = BareRobot(scenario, World("posts", (0.0, 0.0, 0.0), (6.0, 0.0), cylinders=POSTS))
    navigator = Navigator(scenario, warm=False)
    driven(navigator, robot, 3.0)
    assert robot.way > 1.0
    commands = driven(navigator, robot, 4.2, Faults().odometry_stops, begin=3.0)
    assert robot.stands and commands[-1].why.startswith("no odometry")
    assert robot.clearance > 0.0


class SeesItself(BareRobot):
    """Three beams end at a post of the robot itself."""

    def _ranges(self, index):
        ranges = super()._ranges(index)
        ranges[200:203] = 0.2
        return ranges


@pytest.mark.parametrize(("mask", "status"), [("[]", "blocked"), ("[[0.34, 0.40]]", "reached")])
def test_a_robot_whose_lidar_sees_itself_needs_a_mask(mask, status) -> None:
    scenario = parse_scenario(f"lidar: {{mask: {mask}}}", name="robot")
    robot = SeesItself(scenario, World("posts", (0.0, 0.0, 0.0), (2.5, 0.0), cylinders=POSTS))
    assert driven(Navigator(scenario, warm=False), robot, 12.0)[-1].status == status
    assert robot.clearance > 0.0 and (robot.way > 2.0) == (status == "reached")


class Failing(LeafSystem):
    """Raises after a while."""

    def __init__(self) -> None:
        super().__init__()
        self.calls, self.value = 0, np.array((0.8, 0.0))
        self.DeclareVectorOutputPort("desired_twist", 2, self.calc, {self.time_ticket()})

    def calc(self, context, output) -> None:
        self.calls += 1
        if self.calls == 60:
            self.value = np.full(2, math.nan)
        if self.calls > 90:
            raise ValueError("my controller is broken")
        output.SetFromVector(self.value)


def test_a_part_that_fails_stops_the_robot() -> None:
    robot = BareRobot(FOREST)
    navigator = Navigator(FOREST, Parts(controller=Failing()), warm=False)
    commands = driven(navigator, robot, 3.5)
    assert robot.stands and robot.clearance > 0.0
    assert "my controller is broken" in commands[-1].why
    assert any("desired_twist is [nan" in command.why for command in commands)


def test_nothing_has_come_in_yet(forest) -> None:
    command = forest.step(EPOCH)
    assert command.twist.tolist() == [0.0, 0.0] and command.why == "no odometry"
    command = forest.step(EPOCH + 0.02, [], [Odometry(EPOCH + 0.02, 0.0, 0.0, 0.0, 0.0, 0.0)], (1.0, 0.0))
    assert command.why.startswith("no scan")


def test_every_scan_is_processed_whatever_the_rates(forest, robot) -> None:
    seen = []
    for _ in range(40):
        now, _, rows, goal, _ = robot.read()
        lidar = replace(FOREST.lidar, rate=100.0)  # two scans each period
        scans = [
            replace(scan_from(robot.shapes, robot.pose, lidar, 0, robot.ticks), time=now - late) for late in (0.01, 0.0)
        ]
        robot.drive(forest.step(now, scans, rows, goal))
        seen.append(forest.intake.newest_stamps[0])
    last = EPOCH + 39 * robot.period
    assert seen[-1] == pytest.approx(last)
    assert not forest.intake.drop_counts
    assert robot.speed > 0.5
    perception = forest.navigation.perception
    held = perception.GetMyContextFromRoot(forest._simulator.get_context()).get_abstract_state(0).get_value()
    assert held.value.surroundings.time == pytest.approx(last - forest._origin)  # none is forgotten by the next


def test_two_lidars_that_scan_when_they_like() -> None:
    text = "lidar: {rate: 10}\nlidars: [{}, {}]\nrobot: {max_speed: 0.5}"
    scenario = parse_scenario(text, name="two")
    robot = TwoEyes(scenario, World("posts", (0.0, 0.0, 0.0), (6.0, 0.0), cylinders=POSTS))
    navigator = Navigator(scenario, mounts=TwoEyes.MOUNTS, warm=False)
    commands = driven(navigator, robot, 5.0)
    assert robot.way > 1.5 and commands[-1].status == "driving"
    assert sum(count for _, count in navigator.intake.drop_counts) <= 2
    commands = driven(
        navigator, robot, 6.5, lambda r, t: r._replace(scans=[each for each in r.scans if each[0] == 0]), begin=5.0
    )
    assert robot.stands and commands[-1].why.startswith("no scan") and robot.clearance > 0.0


def test_the_diagram_can_be_part_of_a_larger_one() -> None:
    navigator = Navigator(FOREST, warm=False)
    builder = DiagramBuilder()
    inner = builder.AddSystem(navigator.diagram)
    names = {inner.get_input_port(k).get_name() for k in range(inner.num_input_ports())}
    assert names == {"scan", "scan_pose", "state", "goal", "heading"}
    assert inner.HasOutputPort("twist_command") and inner.HasOutputPort("planner.status")


def test_parts_of_the_loop_come_in_by_step() -> None:
    with pytest.raises(StarnavError, match="a station or a goal"):
        Navigator(FOREST, Parts(goal=LeafSystem()), warm=False)
