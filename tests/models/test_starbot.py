"""The shipped robot drives as it is told to: measured in a plant of its own, free of the rest of the package."""

from dataclasses import dataclass

import numpy as np
import pytest
from pydrake.geometry import Box, Role
from pydrake.math import RigidTransform
from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import AddMultibodyPlant, CoulombFriction, MultibodyPlantConfig
from pydrake.multibody.tree import PdControllerGains
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder

from drake_starnav.utils.resources import model_path

WHEELS = ("left_wheel", "right_wheel")
WHEEL_RADIUS = 0.05
TRACK = 0.32
REST_HEIGHT = WHEEL_RADIUS
"""Of base_link's origin, which lies on the axle, m."""
CONTROL_PERIOD = 0.01
STEADY_ERROR = (5e-4, 1.1e-3)
"""Of (v, omega) at most, up to 0.8 m/s and 2 rad/s, whatever the servo's gain; m/s and rad/s."""


class Robot:
    """A starbot on flat ground, with a velocity servo of the given gain (N m s/rad) on its wheels."""

    def __init__(self, gain: float = 1.0, height: float = REST_HEIGHT) -> None:
        builder = DiagramBuilder()
        config = MultibodyPlantConfig(time_step=0.005, contact_model="point", discrete_contact_approximation="lagged")
        self.plant, self.scene_graph = AddMultibodyPlant(config, builder)
        parser = Parser(self.plant)
        parser.package_map().AddPackageXml(str(model_path("package.xml")))
        (self.model,) = parser.AddModelsFromUrl("package://drake_starnav/robots/starbot.urdf")
        X_WG, friction = RigidTransform([0.0, 0.0, -0.5]), CoulombFriction(1.0, 1.0)
        self.plant.RegisterCollisionGeometry(self.plant.world_body(), X_WG, Box(50.0, 50.0, 1.0), "ground", friction)
        for name in WHEELS:
            actuator = self.plant.GetJointActuatorByName(name, self.model)
            actuator.set_controller_gains(PdControllerGains(p=0.0, d=gain))
        self.base = self.plant.GetBodyByName("base_link", self.model)
        self.plant.SetDefaultFloatingBaseBodyPose(self.base, RigidTransform([0.0, 0.0, height]))
        self.plant.Finalize()
        self.simulator = Simulator(builder.Build())
        self.context = self.plant.GetMyMutableContextFromRoot(self.simulator.get_mutable_context())
        self.command(0.0, 0.0)

    def command(self, v: float, omega: float) -> None:
        """Hold the wheel speeds of a twist, m/s and rad/s, from now on."""
        turn = 0.5 * TRACK * omega
        speeds = [0.0, 0.0, (v - turn) / WHEEL_RADIUS, (v + turn) / WHEEL_RADIUS]
        self.plant.get_desired_state_input_port(self.model).FixValue(self.context, speeds)

    def advance(self, duration: float) -> None:
        self.simulator.AdvanceTo(self.context.get_time() + duration)

    def pose(self) -> RigidTransform:
        """X_WB."""
        return self.plant.EvalBodyPoseInWorld(self.context, self.base)

    def twist(self) -> np.ndarray:
        """Speed forward, to the left, and of turning: m/s, m/s, rad/s."""
        V_WB = self.plant.EvalBodySpatialVelocityInWorld(self.context, self.base)
        v_B = self.pose().rotation().inverse() @ V_WB.translational()
        return np.array([v_B[0], v_B[1], V_WB.rotational()[2]])


@dataclass
class Drive:
    """What a ramp to a twist showed: errors of (v, omega) while ramping at most, and at the end; largest tilt, rad."""

    ramp_error: np.ndarray
    final_error: np.ndarray
    tilt: float


def drive(robot: Robot, v: float, omega: float, acceleration: float, yaw_acceleration: float) -> Drive:
    """Ramp from rest to a twist at the given accelerations and hold it, 3 s in all."""
    robot.advance(0.5)
    errors, tilt = [], 0.0
    for step in range(1, 301):
        time = step * CONTROL_PERIOD
        target = np.array([min(v, acceleration * time), min(omega, yaw_acceleration * time)])
        robot.command(*target)
        robot.advance(CONTROL_PERIOD)
        errors.append(robot.twist()[[0, 2]] - target)
        tilt = max(tilt, float(np.arccos(min(1.0, robot.pose().rotation().matrix()[2, 2]))))
    return Drive(np.abs(errors).max(axis=0), np.array(errors[-1]), tilt)


def test_rests_where_it_starts() -> None:
    robot = Robot()
    robot.advance(2.0)
    np.testing.assert_allclose(robot.pose().translation(), [0.0, 0.0, REST_HEIGHT], atol=2e-4)
    np.testing.assert_allclose(robot.pose().rotation().matrix(), np.eye(3), atol=1e-3)
    np.testing.assert_allclose(robot.twist(), 0.0, atol=1e-4)


@pytest.mark.parametrize(("v", "omega"), [(0.8, 2.0), (0.8, 0.0), (0.0, -2.0), (-0.4, 1.0)])
def test_drives_the_commanded_twist(v: float, omega: float) -> None:
    robot = Robot()
    robot.command(v, omega)
    robot.advance(3.0)
    np.testing.assert_array_less(np.abs(robot.twist()[[0, 2]] - [v, omega]), STEADY_ERROR)


@pytest.mark.parametrize(("gain", "v_bound", "omega_bound"), [(1.0, 0.012, 0.06), (10.0, 0.001, 0.005)])
def test_a_stiffer_servo_follows_a_ramp_more_closely(gain: float, v_bound: float, omega_bound: float) -> None:
    result = drive(Robot(gain), 0.8, 2.0, acceleration=1.0, yaw_acceleration=4.0)
    assert result.ramp_error[0] < v_bound
    assert result.ramp_error[1] < omega_bound
    np.testing.assert_array_less(np.abs(result.final_error), STEADY_ERROR)


def test_keeps_its_grip_and_stays_level_in_a_fast_turn() -> None:
    result = drive(Robot(10.0), 2.0, 3.0, acceleration=3.0, yaw_acceleration=8.0)  # 6 m/s^2 sideways
    np.testing.assert_array_less(np.abs(result.final_error), (1e-3, 1e-3))
    assert result.tilt < np.radians(0.1)


def _geometry_span(robot: Robot, name: str) -> tuple[float, float, float]:
    """Lowest and highest point above the ground, and radius, of a cylinder of base_link at rest, m."""
    inspector = robot.scene_graph.model_inspector()
    frame = robot.plant.GetBodyFrameIdOrThrow(robot.base.index())
    geometry = inspector.GetGeometryIdByName(frame, Role.kProximity, f"starbot::{name}")
    shape, z = inspector.GetShape(geometry), REST_HEIGHT + inspector.GetPoseInFrame(geometry).translation()[2]
    return z - 0.5 * shape.length(), z + 0.5 * shape.length(), shape.radius()


def test_hull_and_lidar_are_where_the_documentation_says() -> None:
    robot = Robot()
    low, high, radius = _geometry_span(robot, "hull")
    assert (low, high, radius) == pytest.approx((0.03, 0.13, 0.25))
    X_BS = robot.plant.GetFrameByName("lidar", robot.model).GetFixedPoseInBodyFrame()
    np.testing.assert_allclose(X_BS.GetAsMatrix4(), RigidTransform([0.0, 0.0, high - REST_HEIGHT]).GetAsMatrix4())


def test_nothing_reaches_out_of_the_hull() -> None:
    robot = Robot()
    inspector = robot.scene_graph.model_inspector()
    for index in robot.plant.GetBodyIndices(robot.model):
        body = robot.plant.get_body(index)
        X_WB = robot.plant.EvalBodyPoseInWorld(robot.context, body)
        for geometry in robot.plant.GetCollisionGeometriesForBody(body):
            p_WG = (X_WB @ inspector.GetPoseInFrame(geometry)).translation()
            assert np.hypot(*p_WG[:2]) + inspector.GetShape(geometry).radius() <= 0.25 + 1e-12
