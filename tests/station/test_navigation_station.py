"""The station as its ports show it: it drives as told, says where it is, and sees what stands around it."""

import math
from typing import Any

import numpy as np
import pytest
from pydrake.geometry import Cylinder
from pydrake.math import RigidTransform
from pydrake.multibody.plant import AddMultibodyPlant, CoulombFriction
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder

from drake_starnav.lidar.sensor_model import LidarParameters
from drake_starnav.robot import RobotParameters
from drake_starnav.scenario.schema import DriveParameters, LocalizationParameters, Scenario
from drake_starnav.station.navigation_station import NavigationStation
from drake_starnav.station.plant import plant_config
from drake_starnav.station.robot_interface import RobotInterface
from drake_starnav.station.robot_model import add_robot
from drake_starnav.station.world_geometry import add_ground
from drake_starnav.worlds.world import World
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


def test_begins_at_the_start_and_stays_there() -> None:
    drive = Drive()
    assert drive.out("localization.state") == pytest.approx([*START, 0.0, 0.0], abs=1e-12)
    drive.advance(2.0)
    assert drive.out("localization.state") == pytest.approx([*START, 0.0, 0.0], abs=1e-4)


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


@pytest.mark.parametrize("radius", [0.12, 0.2, 0.3])
@pytest.mark.parametrize("bearing", [0.0, 0.5 * math.pi])
def test_the_robot_has_the_radius_of_the_parameters(radius: float, bearing: float) -> None:
    gap = 0.01
    post = (radius + gap + 0.2) * np.array((math.cos(bearing), math.sin(bearing)))
    world = World("post", (0.0, 0.0, 0.0), (1.0, 0.0), cylinders=[(*post, 0.2)])
    drive = Drive(world, robot=RobotParameters(radius=radius))
    query = drive.out("cheat.geometry_query")
    inspector = drive.station.scene_graph.model_inspector()
    others = [g for g in inspector.GetAllGeometryIds() if inspector.GetName(g).endswith("cylinder_0")]
    distances = [
        query.ComputeSignedDistancePairClosestPoints(mine, others[0]).distance
        for mine in drive.station.robot_geometries
        if not inspector.CollisionFiltered(mine, others[0])  # what touches nothing but the floor
    ]
    assert min(distances) == pytest.approx(gap, abs=1e-6)


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


def test_a_heavier_base_obeys_too() -> None:
    light, heavy = Drive(), Drive(robot=RobotParameters(mass_error=0.5))
    masses = [drive.station.plant.GetBodyByName("base_link").default_mass() for drive in (light, heavy)]
    assert masses[1] == pytest.approx(1.5 * masses[0])
    for drive in (light, heavy):
        drive.command(0.5, 0.0)
        drive.advance(SETTLED)
    assert heavy.truth()[3] == pytest.approx(light.truth()[3], abs=2e-3)


def test_the_scan_s_pose_is_as_late_as_the_scan() -> None:
    drive = Drive(lidar=LidarParameters(noise=0.0, delay=0.12))
    drive.command(0.8, 0.3)
    drive.advance(0.122)
    for k in range(20):
        assert drive.out("lidar.scan").time == pytest.approx(0.05 * k)
        assert drive.out("localization.scan_pose") == pytest.approx(planar(drive.out("lidar.X_WS")), abs=5e-4)
        drive.advance(0.05)


@pytest.mark.parametrize("delay", [0.0, 0.03, 0.12])
def test_the_scan_s_pose_waits_with_the_scan_where_scans_are_lost(delay: float) -> None:
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
    assert drive.out("localization.state")[3:] == pytest.approx(drive.truth()[3:], abs=1e-9)
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


def test_robots_of_one_plant_drive_apart_and_see_each_other() -> None:
    """Two robots side by side in a plant of the user's own; a collar reaches into the plane of the lidars."""
    builder = DiagramBuilder()
    plant, scene_graph = AddMultibodyPlant(plant_config(0.005), builder)
    add_ground(plant, (-2.0, -2.0, 2.0, 2.0))
    starts = {"a": (0.0, -0.5, 0.0), "b": (0.0, 0.5, 0.0)}
    models = {name: add_robot(plant, scene_graph, RobotParameters(), at, name=name) for name, at in starts.items()}
    for name, model in models.items():
        base = plant.GetBodyByName("base_link", model)
        plant.RegisterCollisionGeometry(
            base, RigidTransform([0, 0, 0.1]), Cylinder(0.25, 0.1), f"collar_{name}", CoulombFriction(0.3, 0.3)
        )
    plant.Finalize()
    robots = {}
    for name, model in models.items():
        robot = builder.AddNamedSystem(
            name, RobotInterface(plant, scene_graph, model, Scenario("test", None, lidar=LIDAR))
        )
        builder.Connect(scene_graph.get_query_output_port(), robot.GetInputPort("geometry_query"))
        builder.Connect(plant.get_state_output_port(model), robot.GetInputPort("multibody_state"))
        builder.Connect(robot.GetOutputPort("desired_state"), plant.get_desired_state_input_port(model))
        robots[name] = robot
    simulator = Simulator(builder.Build())
    context = simulator.get_mutable_context()
    for name, twist in (("a", (0.4, 0.0)), ("b", (-0.4, 0.0))):
        robot = robots[name]
        robot.GetInputPort("drive.twist_command").FixValue(robot.GetMyMutableContextFromRoot(context), twist)

    def out(name: str, port: str) -> Any:
        return robots[name].GetOutputPort(port).Eval(robots[name].GetMyContextFromRoot(context))

    simulator.Initialize()
    ranges = {name: out(name, "lidar.ranges").copy() for name in models}
    for name, side in (("a", 0.5), ("b", -0.5)):
        beam = int((side * math.pi - LIDAR.angle_min) / LIDAR.angle_increment)
        assert ranges[name][beam] == pytest.approx(1.0 - 0.25, abs=1e-3)
        assert np.isinf(ranges[name]).sum() > 0.8 * LIDAR.beams  # neither itself nor anything else
    simulator.AdvanceTo(2.0)
    (xa, ya, _), (xb, yb, _) = out("a", "localization.pose"), out("b", "localization.pose")
    assert (ya, yb) == pytest.approx((-0.5, 0.5), abs=5e-3)
    assert (xa, xb) == pytest.approx((0.8, -0.8), abs=0.05)
    assert not set(robots["a"].robot_geometries) & set(robots["b"].robot_geometries)
