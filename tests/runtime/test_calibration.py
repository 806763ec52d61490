"""What a robot is like is found in its log, and declared it is enough."""

import math

import numpy as np
import pytest

from drake_starnav import ControllerParameters, World, parse_scenario
from drake_starnav.runtime import Command, Navigator, read_log
from drake_starnav.runtime.calibration import calibrate, estimate_drive, estimate_lidar, estimate_mask, select_drive
from drake_starnav.runtime.log import RunLog
from tests.helpers.bare_robot import Slipping, TwoEyes

pytest.importorskip("mcap")
ROOM = World("room", (0.0, 0.0, 0.0), (3.0, 1.0), bounds=(-2.0, -2.0, 5.0, 3.0), cylinders=np.array([(1.6, 1.4, 0.3)]))
PERIOD = 1.0 / ControllerParameters().rate


class Flawed(Slipping):
    """Commands take effect late, wheels lose a share of their speed, scans come late, and the lidar sees two posts.

    The ground gives less than the wheels turn, which odometry counts.
    """

    def __init__(self, scenario, late=0, slip=0.0, scans_late=0, own=(), ground=0.0) -> None:
        super().__init__(scenario, 1.0 - ground, world=ROOM)
        self.pending, self.kept, self.own = [np.zeros(2)] * late, 1.0 - slip, own
        self.scans_late, self.on_the_way = scans_late, []

    def _ranges(self, index):
        ranges = super()._ranges(index)
        for beam in self.own:
            ranges[beam] = 0.2 + 0.002 * math.sin(37.0 * index + beam) if beam < 300 else -math.inf
        return ranges

    def read(self):
        reading = super().read()
        self.on_the_way.append(reading.scans)
        arrived = self.on_the_way.pop(0) if len(self.on_the_way) > self.scans_late else []
        return reading._replace(scans=arrived)

    def drive(self, command) -> None:
        self.pending.append(command.twist * self.kept)
        super().drive(Command(self.pending.pop(0), True, "driving", ""))


def logged(tmp_path, text="", seconds=14.0, took=0.0, **flaws):
    """The log of a robot that stands, drives a curve there and back, and stands."""
    scenario = parse_scenario(text or "{}", name="robot")
    navigator, robot = Navigator(scenario, warm=False), Flawed(scenario, **flaws)
    log = RunLog(tmp_path / "run.mcap", navigator)
    while robot.time < seconds:
        reading, t = robot.read(), robot.time
        v = 0.0 if t < 1.5 or t > seconds - 1.5 else 0.5 * math.sin(1.1 * (t - 1.5))
        command = Command(np.array((v, 1.2 * v)), True, "driving", "")
        log.note(reading, command, took)
        robot.drive(command)
    log.close()
    return read_log(tmp_path / "run.mcap"), scenario


def test_a_good_robot_needs_no_faults_declared(tmp_path) -> None:
    seen = select_drive(*logged(tmp_path))
    drive = estimate_drive(seen)
    assert drive["delay"] == drive["error"] == 0.0 and drive["slip"] <= 0.01
    lidar = estimate_lidar(seen)
    assert lidar["beams"] == 360 and lidar["rate"] == 20.0 and lidar["delay"] == 0.0
    assert lidar["noise"] == pytest.approx(0.01, abs=0.0021)
    assert estimate_mask(seen) == []


@pytest.mark.parametrize(("late", "slip"), [(0, 0.05), (3, 0.0), (10, 0.15)])
def test_the_delay_of_commands_and_slip(tmp_path, late, slip) -> None:
    drive = estimate_drive(select_drive(*logged(tmp_path, late=late, slip=slip)))
    assert drive["delay"] == pytest.approx(PERIOD * late, abs=0.0101) and slip <= drive["slip"] <= slip + 0.03


@pytest.mark.parametrize("ground", [0.0, 0.08, 0.25])
def test_slip_of_the_ground_that_odometry_does_not_show(tmp_path, ground) -> None:
    log, scenario = logged(tmp_path, ground=ground)
    declared = parse_scenario(calibrate(log, scenario), name="calibrated")
    assert ground <= declared.localization.drift <= 1.25 * ground / (1.0 - ground) + (ground > 0.0) * 0.02


@pytest.mark.parametrize(("noise", "dropout", "late"), [(0.002, 0.0, 0), (0.03, 0.0, 0), (0.01, 0.1, 4)])
def test_noise_lost_beams_and_delay_of_scans(tmp_path, noise, dropout, late) -> None:
    text = f"lidar: {{noise: {noise}, dropout: {dropout}}}"
    lidar = estimate_lidar(select_drive(*logged(tmp_path, text, scans_late=late)))
    assert noise * 0.85 <= lidar["noise"] <= noise * 1.25 + 0.001
    assert lidar["dropout"] == pytest.approx(dropout, abs=0.01)
    assert lidar["delay"] == pytest.approx(late * PERIOD, abs=0.002)  # each comes at a step: none waits for one


def test_what_the_lidar_sees_of_the_robot(tmp_path) -> None:
    seen = select_drive(*logged(tmp_path, own=(40, 41, 42, 300)))
    step = 2.0 * math.pi / 360
    wanted = [(-math.pi + (a - 0.5) * step, -math.pi + (b + 0.5) * step) for a, b in ((40, 42), (300, 300))]
    mask = estimate_mask(seen)
    assert mask is not None and np.allclose(mask, wanted, atol=1e-4)
    scan = seen.scans[-1][1].mask_sectors(mask)
    assert np.flatnonzero(np.isnan(scan.ranges)).tolist() == [40, 41, 42, 300]


def test_a_robot_that_hardly_moved_does_not_know_what_of_it_is_seen(tmp_path) -> None:
    log, scenario = logged(tmp_path, seconds=3.2, own=(40,))
    assert "  # mask: unknown" in calibrate(log, scenario)


def test_its_yaml_is_a_scenario_s(tmp_path) -> None:
    declared = parse_scenario(calibrate(*logged(tmp_path, late=5, slip=0.05, own=(40,))), name="calibrated")
    assert len(declared.lidar.mask) == 1
    assert declared.drive.delay == pytest.approx(5 * PERIOD, abs=0.011) and declared.drive.slip >= 0.05
    assert declared.lidar.field_of_view.full_circle


def test_each_of_two_lidars_is_declared(tmp_path) -> None:
    lidars = "lidars: [{frame: front, beams: 360, rate: 10}, {frame: rear, beams: 360, rate: 10, noise: 0.03}]"
    scenario = parse_scenario(lidars, name="two")
    navigator, robot = Navigator(scenario, mounts=TwoEyes.MOUNTS, warm=False), TwoEyes(scenario, ROOM)
    log = RunLog(tmp_path / "run.mcap", navigator)
    while robot.time < 4.0:
        command = Command(np.array((0.4 * (robot.time > 1.5), 0.0)), True, "driving", "")
        log.note(robot.read(), command)
        robot.drive(command)
    log.close()
    declared = parse_scenario(calibrate(read_log(tmp_path / "run.mcap"), scenario), name="calibrated")
    assert [lidar.frame for lidar in declared.lidars] == ["front", "rear"]
    assert [lidar.rate for lidar in declared.lidars] == [10.0, 10.0]
