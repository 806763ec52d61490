"""What belongs to a robot in a plant of the user's own: its links, what joints hold to them, what it carries."""

import math

import numpy as np
import pytest
from pydrake.geometry import Box, HalfSpace
from pydrake.math import RigidTransform
from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import AddMultibodyPlant, CoulombFriction
from pydrake.multibody.tree import SpatialInertia
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder

from drake_starnav import CollisionMonitor, LidarParameters, Parts, StarnavError, World, add_navigation, parse_scenario
from drake_starnav.station import add_robot, plant_config
from drake_starnav.station.robot_interface import RobotInterface, connect_robot
from drake_starnav.utils.resources import find_model_path

SCENARIO = parse_scenario("world: !Obstacles {}\nlidar: {beams: 72, noise: 0}", name="own plant")
FRICTION = CoulombFriction(0.5, 0.5)


class OwnPlant:
    """A robot with the shipped arm on its deck, in a plant with a half space as the floor, and boxes as wanted."""

    def __init__(self, posture=(0.0, 0.0, 0.0)) -> None:
        self.builder = DiagramBuilder()
        self.plant, self.scene_graph = AddMultibodyPlant(plant_config(), self.builder)
        world = self.plant.world_body()
        self.ground = self.plant.RegisterCollisionGeometry(
            world, RigidTransform(), HalfSpace(), "ground", CoulombFriction(1.0, 1.0)
        )
        self.model = add_robot(self.plant, self.scene_graph, SCENARIO.robot, (0.0, 0.0, 0.0))
        (self.arm,) = Parser(self.plant).AddModels(str(find_model_path("arms", "lift_arm.urdf")))
        base, foot = (self.plant.GetFrameByName(name) for name in ("base_link", "foot"))
        self.plant.WeldFrames(base, foot, RigidTransform([-0.13, 0.0, 0.081]))
        for name, angle in zip(("turn", "lift", "bend"), posture, strict=True):
            self.plant.GetJointByName(name, self.arm).set_default_positions([angle])

    def add_box(self, name: str, X_WB: RigidTransform, size: Box) -> object:
        body = self.plant.AddRigidBody(
            name, self.plant.AddModelInstance(name), SpatialInertia.SolidBoxWithMass(0.2, 0.1, 0.1, 0.1)
        )
        self.plant.RegisterCollisionGeometry(body, RigidTransform(), size, name, FRICTION)
        self.plant.SetDefaultFloatingBaseBodyPose(body, X_WB)
        return body

    def robot(self, **arguments) -> RobotInterface:
        self.plant.Finalize()
        lidar = RobotInterface(self.plant, self.scene_graph, self.model, SCENARIO, **arguments)
        robot = self.builder.AddNamedSystem("robot", lidar)
        connect_robot(self.builder, self.plant, self.scene_graph, self.model, robot)
        return robot

    def names(self, geometries) -> set[str]:
        inspector = self.scene_graph.model_inspector()
        return {inspector.GetName(geometry).rpartition("::")[2] for geometry in geometries}


def test_an_arm_and_a_load_are_part_of_the_robot_and_not_seen_by_it() -> None:
    own = OwnPlant()
    load = own.add_box("load", RigidTransform([0.1, 0.0, 0.2]), Box(0.1, 0.1, 0.1))
    own.add_box("pillar", RigidTransform([0.0, 1.0, 0.3]), Box(0.2, 0.2, 0.6))
    robot = own.robot(carried=[load.index()])
    names = own.names(robot.robot_geometries)
    assert {"hull", "left_wheel", "foot", "upper_arm", "forearm", "load"} <= names and "pillar" not in names
    assert own.names(robot.floor) == {"ground"}
    own.builder.ExportInput(robot.GetInputPort("drive.twist_command"), "twist")
    diagram = own.builder.Build()
    simulator = Simulator(diagram)
    diagram.GetInputPort("twist").FixValue(simulator.get_mutable_context(), [0.0, 0.0])
    actuation = own.plant.get_actuation_input_port(own.arm)
    actuation.FixValue(own.plant.GetMyMutableContextFromRoot(simulator.get_mutable_context()), np.zeros(3))
    simulator.Initialize()
    ranges = robot.GetOutputPort("lidar.ranges").Eval(robot.GetMyContextFromRoot(simulator.get_context()))
    seen = LidarParameters(beams=72).angle_min + 2.0 * math.pi / 72 * np.flatnonzero(np.isfinite(ranges))
    assert len(seen) and np.abs(seen - math.pi / 2.0).max() < 0.15  # the pillar alone


@pytest.mark.parametrize(
    ("posture", "fits"), [((0.0, 0.0, 0.0), True), ((0.3, 0.35, 1.35), True), ((3.0, 1.3, 0.0), False)]
)
def test_the_arm_must_fit_into_the_robot_s_radius_as_it_is_folded(posture, fits: bool) -> None:
    own = OwnPlant(posture)
    robot, world = own.robot(), World("own", (0.0, 0.0, 0.0), (2.0, 0.0))
    assert (robot.sticking_out(SCENARIO.robot)[0] == 0.0) == fits
    if fits:
        add_navigation(own.builder, SCENARIO, Parts(world, robot))
        return
    with pytest.raises(StarnavError, match="link forearm of the station.s robot sticks out of robot.radius 0.25 m"):
        add_navigation(own.builder, SCENARIO, Parts(world, robot))


def test_a_contact_of_the_arm_is_the_robot_s_and_one_between_them_is_none() -> None:
    own = OwnPlant()
    own.plant.set_gravity_enabled(own.arm, False)  # and stiff, so that it stays upright
    for name in ("turn", "lift", "bend"):
        own.plant.GetJointByName(name, own.arm).set_default_damping(5.0)
    beam = RigidTransform([0.6, 0.0, 0.5])  # above the hull and the lidar
    own.plant.RegisterCollisionGeometry(own.plant.world_body(), beam, Box(0.1, 2.0, 0.1), "beam", FRICTION)
    robot = own.robot()
    CollisionMonitor.AddToBuilder(own.builder, robot)
    own.builder.ExportInput(robot.GetInputPort("drive.twist_command"), "twist")
    own.builder.ExportInput(own.plant.get_actuation_input_port(own.arm), "arm")
    diagram = own.builder.Build()
    simulator = Simulator(diagram)
    diagram.GetInputPort("twist").FixValue(simulator.get_mutable_context(), [0.6, 0.0])
    diagram.GetInputPort("arm").FixValue(simulator.get_mutable_context(), np.zeros(3))
    status = simulator.AdvanceTo(3.0)
    assert status.message().startswith(("collision of forearm with beam at ", "collision of upper_arm with beam at "))
