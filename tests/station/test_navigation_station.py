"""The station as its ports show it: it drives as told, says where it is, and sees what stands around it."""

import math

import numpy as np
import pytest
from pydrake.systems.analysis import Simulator

from drake_starnav import LidarParameters, World
from drake_starnav.scenario.schema import DriveParameters, LocalizationParameters, Scenario
from drake_starnav.station.navigation_station import NavigationStation
from tests.helpers.scans import cast

STEADY_ERROR = (6e-4, 1.2e-3)
"""Of (v, omega) up to 0.8 m/s and 2 rad/s, m/s and rad/s."""
SETTLED = 1.0
"""After a step to full speed the robot drives steadily, s."""
OFF_GRID = 0.6013
"""Between two steps of the plant, s."""
START = (1.0, -2.0, 0.6)
LIDAR = LidarParameters(noise=0.0)


class Drive:
    """A station in a world, driven by twists."""

    def __init__(self, world: World | None = None, *, seed: int = 0, **sections) -> None:
        world = world or World("open", START, (5.0, 0.0))
        scenario = Scenario("test", None, **{"lidar": LIDAR, **sections})
        self.station = NavigationStation(world, scenario, seed=seed)
        self.simulator = Simulator(self.station)
        self.context = self.simulator.get_mutable_context()
        self.command(0.0, 0.0)

    def command(self, v: float, omega: float) -> None:
        self.station.GetInputPort("drive.twist_command").FixValue(self.context, [v, omega])

    def advance(self, duration: float) -> None:
        self.simulator.AdvanceTo(self.context.get_time() + duration)

    def truth(self) -> np.ndarray:
        """(x, y, yaw, v, omega) by the plant itself."""
        plant = self.station.plant
        context, base = plant.GetMyContextFromRoot(self.context), plant.GetBodyByName("base_link")
        X_WB, V_WB = plant.EvalBodyPoseInWorld(context, base), plant.EvalBodySpatialVelocityInWorld(context, base)
        v_B = X_WB.rotation().inverse() @ V_WB.translational()
        return np.array([*planar(X_WB), v_B[0], V_WB.rotational()[2]])

    def out(self, name: str):
        value = self.station.GetOutputPort(name).Eval(self.context)
        return value.copy() if isinstance(value, np.ndarray) else value


def planar(X_WF) -> tuple[float, float, float]:
    """(x, y, yaw) of a frame."""
    x, y, _ = X_WF.translation()
    R_WF = X_WF.rotation().matrix()
    return x, y, math.atan2(R_WF[1, 0], R_WF[0, 0])


def turned(angle: float, since: float) -> float:
    """By how much an angle differs from another, in (-pi, pi]."""
    return math.remainder(angle - since, 2.0 * math.pi)


@pytest.mark.parametrize(("v", "omega"), [(0.8, 0.0), (-0.4, 0.0), (0.0, 2.0), (0.0, -1.0), (0.8, 2.0), (0.5, -0.7)])
def test_drives_the_commanded_twist(v: float, omega: float) -> None:
    drive = Drive()
    drive.command(v, omega)
    drive.advance(SETTLED)
    begin = drive.truth()
    assert abs(begin[3] - v) <= STEADY_ERROR[0]
    assert abs(begin[4] - omega) <= STEADY_ERROR[1]
    assert drive.out("localization.state")[3:] == pytest.approx(begin[3:], abs=1e-2)
    duration = 1.0
    drive.advance(duration)
    pose = drive.truth()
    # the arc that the twist describes
    yaw, turn = begin[2], omega * duration
    chord = v * duration * np.sinc(0.5 * turn / math.pi)
    expected = begin[:2] + chord * np.array([math.cos(yaw + 0.5 * turn), math.sin(yaw + 0.5 * turn)])
    assert pose[:2] == pytest.approx(expected, abs=5e-3)  # within a step of the plant
    assert turned(pose[2], yaw + turn) == pytest.approx(0.0, abs=STEADY_ERROR[1] * duration + 1e-9)


def test_lidar_sees_the_obstacles_from_where_the_robot_is_and_never_the_robot() -> None:
    world = World("posts", START, (5.0, 0.0), cylinders=[(2.5, -2.0, 0.3), (0.5, -0.8, 0.2)], bounds=(-2, -4, 5, 2))
    drive = Drive(world)
    drive.command(0.3, 0.8)
    drive.advance(0.99)
    scan, pose = drive.out("lidar.scan"), planar(drive.out("lidar.X_WS"))
    exact = cast(world, np.array(pose), beams=LIDAR.beams, range_max=LIDAR.range_max)
    both = scan.hits & exact.hits
    assert both.sum() > 0.99 * max(scan.hits.sum(), exact.hits.sum())
    # beams along an edge differ by more than the others, for the robot tilts a little
    assert np.quantile(np.abs(scan.ranges[both] - exact.ranges[both]), 0.95) < 1e-3
    assert np.array_equal(drive.out("lidar.ranges"), scan.ranges)
    assert scan.ranges.min() > 0.25
    assert drive.out("lidar.point_cloud").size() == scan.hits.sum()


def test_a_late_drive_does_the_same_later() -> None:
    prompt, late = Drive(), Drive(drive=DriveParameters(delay=0.052))
    for drive in (prompt, late):
        drive.command(0.6, 0.4)
    prompt.advance(OFF_GRID)
    late.advance(OFF_GRID + 0.055)  # whole steps of the plant
    assert late.truth() == pytest.approx(prompt.truth(), abs=2e-3)
    assert np.hypot(*(late.truth()[:2] - START[:2])) > 0.2


def test_wheels_lose_no_more_than_the_declared_share() -> None:
    slip, drive = 0.2, Drive(drive=DriveParameters(slip=0.2), seed=3)
    drive.command(0.5, 0.0)
    speeds, rates = [], []
    for _ in range(6):
        drive.advance(0.9)
        speeds.append(drive.truth()[3])
        rates.append(abs(drive.truth()[4]))
        drive.advance(0.1)
    assert min(speeds) >= (1.0 - slip) * 0.5 - 2e-3 and max(speeds) <= 0.5 + 2e-3 and np.ptp(speeds) > 0.01
    assert 0.01 < max(rates) <= slip * 0.5 / 0.25  # the wheels are farther apart than the robot's radius


@pytest.mark.parametrize("delay", [0.0, 0.03, 0.12])
def test_the_scan_s_pose_is_as_late_as_the_scan(delay: float) -> None:
    """And waits with it where scans are lost."""
    lidar = LidarParameters(noise=0.0, delay=delay, scan_loss=0.5, silence_start=0.4, silence_duration=0.4)
    drive = Drive(lidar=lidar, seed=3)
    drive.command(0.8, 0.3)
    drive.advance(delay + 0.002)
    times = []
    for _ in range(40):
        times.append(drive.out("lidar.scan").time)
        assert drive.out("localization.scan_pose") == pytest.approx(planar(drive.out("lidar.X_WS")), abs=5e-4)
        drive.advance(0.05)
    assert 10 < len(set(times)) < 30


def test_drift_is_a_share_of_the_way_and_velocity_stays_true() -> None:
    drive = Drive(localization=LocalizationParameters(drift=0.05), seed=2)
    drive.command(0.8, 0.0)
    drive.advance(3.0)
    way = np.hypot(*(drive.truth()[:2] - START[:2]))
    assert np.hypot(*(drive.out("localization.pose") - drive.truth()[:3])[:2]) == pytest.approx(0.05 * way, rel=0.02)
    believed_state = (*drive.out("localization.pose"), *drive.truth()[3:])
    assert drive.out("localization.state") == pytest.approx(believed_state, abs=1e-9)
    drive.command(0.0, 1.0)
    before, believed = drive.truth()[2], drive.out("localization.pose")[2]
    drive.advance(2.0)
    angle = turned(drive.truth()[2], before)
    assert abs(turned(drive.out("localization.pose")[2], believed) - angle) == pytest.approx(0.05 * angle, rel=0.05)


def test_the_believed_position_jumps_by_the_declared_step() -> None:
    drive = Drive(localization=LocalizationParameters(jump=0.3, jump_interval=0.5))
    errors = []
    for _ in range(3):
        drive.advance(0.45)
        errors.append((drive.out("localization.pose") - drive.truth()[:3])[:2])
        drive.advance(0.05 + 1e-3)
    steps = np.hypot(*np.diff([(0.0, 0.0), *errors], axis=0).T)
    assert steps == pytest.approx([0.0, 0.3, 0.3], abs=1e-6)
