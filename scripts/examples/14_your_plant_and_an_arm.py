"""Your plant, our robot, and an arm: a plant of your own with racks and a crate, through which a robot carries an arm.

Drake's `InverseDynamicsController` holds the arm. What is joined to the robot belongs to it:
the lidar does not see the arm, its contacts count as the robot's, and it must fit into `robot.radius` as it is folded.

Run: python scripts/examples/14_your_plant_and_an_arm.py [--html FILE] [--png FILE]
"""

import argparse
import logging
import tempfile
from pathlib import Path

import numpy as np
from pydrake.geometry import Box
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import AddMultibodyPlant, CoulombFriction, MultibodyPlant
from pydrake.multibody.tree import ModelInstanceIndex, SpatialInertia
from pydrake.systems.analysis import Simulator
from pydrake.systems.controllers import InverseDynamicsController
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.primitives import ConstantVectorSource, LogVectorOutput

from drake_starnav import (
    ArrivalMonitor,
    CollisionMonitor,
    Parts,
    Recorder,
    RobotInterface,
    World,
    add_navigation,
    parse_scenario,
)
from drake_starnav.station import add_ground, add_robot, add_world, connect_robot, plant_config

SCENARIO = parse_scenario("world: !Obstacles {}", name="your plant")
WORLD = World("hall", start=(0.0, 0.0, 0.0), goal=(5.4, 0.3), bounds=(-0.6, -1.7, 6.0, 1.7))
"""Start, goal, and four walls; it need not know what else is in the plant."""
ARM = Path(__file__).parents[2] / "models" / "arms" / "lift_arm.urdf"
POSTURE = np.array([0.3, 0.35, 1.35])
"""Of the arm's joints, rad."""
RACKS = {"rack_a": (1.6, 0.6, 0.1), "rack_b": (2.6, -0.9, -0.3), "rack_c": (4.0, 0.6, 0.5)}
"""Places (x, y, yaw), m and rad."""
BLUE, BROWN = [0.20, 0.40, 0.70, 1.0], [0.62, 0.44, 0.27, 1.0]


def add_hall(plant: MultibodyPlant) -> None:
    """Racks on the world body, and a crate that can be pushed."""
    friction = CoulombFriction(0.5, 0.5)
    for name, (x, y, yaw) in RACKS.items():
        X_WR = RigidTransform(RotationMatrix.MakeZRotation(yaw), [x, y, 0.4])
        plant.RegisterCollisionGeometry(plant.world_body(), X_WR, Box(1.4, 0.4, 0.8), name, friction)
        plant.RegisterVisualGeometry(plant.world_body(), X_WR, Box(1.4, 0.4, 0.8), f"{name}_visual", BLUE)
    crate = plant.AddRigidBody(
        "crate", plant.AddModelInstance("crate"), SpatialInertia.SolidBoxWithMass(8.0, 0.4, 0.4, 0.4)
    )
    plant.RegisterCollisionGeometry(crate, RigidTransform(), Box(0.4, 0.4, 0.4), "crate", friction)
    plant.RegisterVisualGeometry(crate, RigidTransform(), Box(0.4, 0.4, 0.4), "crate_visual", BROWN)
    plant.SetDefaultFloatingBaseBodyPose(crate, RigidTransform([1.2, -0.5, 0.2]))


def add_arm(plant: MultibodyPlant, robot: ModelInstanceIndex) -> ModelInstanceIndex:
    """The arm, folded, behind the lidar on the robot's deck."""
    (arm,) = Parser(plant).AddModels(str(ARM))
    X_BF = RigidTransform([-0.13, 0.0, 0.082])
    plant.WeldFrames(plant.GetFrameByName("base_link", robot), plant.GetFrameByName("foot", arm), X_BF)
    for name, angle in zip(("turn", "lift", "bend"), POSTURE, strict=True):
        plant.GetJointByName(name, arm).set_default_positions([angle])
    return arm


def hold_arm(builder: DiagramBuilder, plant: MultibodyPlant, arm: ModelInstanceIndex) -> None:
    """Let Drake's controller hold the arm, with a model of the arm alone."""
    alone = MultibodyPlant(0.0)
    Parser(alone).AddModels(str(ARM))
    alone.WeldFrames(alone.world_frame(), alone.GetFrameByName("foot"))
    alone.Finalize()
    gains = {"kp": [400.0] * 3, "ki": [0.0] * 3, "kd": [40.0] * 3}
    controller = builder.AddNamedSystem(
        "arm", InverseDynamicsController(alone, **gains, has_reference_acceleration=False)
    )
    posture = builder.AddSystem(ConstantVectorSource([*POSTURE, 0.0, 0.0, 0.0]))
    builder.Connect(posture.get_output_port(), controller.get_input_port_desired_state())
    builder.Connect(plant.get_state_output_port(arm), controller.get_input_port_estimated_state())
    builder.Connect(controller.get_output_port_control(), plant.get_actuation_input_port(arm))


def main(html: Path, png: Path | None) -> None:
    """Drive through the hall, say how it went and how far the arm was bent, and record it."""
    logging.getLogger("drake").setLevel(logging.WARNING)  # Meshcat would name its port
    builder = DiagramBuilder()
    plant, scene_graph = AddMultibodyPlant(plant_config(), builder)
    add_ground(plant, WORLD.extent)
    add_world(plant, WORLD)
    add_hall(plant)
    model = add_robot(plant, scene_graph, SCENARIO.robot, WORLD.start)
    arm = add_arm(plant, model)
    plant.Finalize()

    robot = builder.AddNamedSystem("robot", RobotInterface(plant, scene_graph, model, SCENARIO))
    connect_robot(builder, plant, scene_graph, model, robot)
    hold_arm(builder, plant, arm)
    navigation = add_navigation(builder, SCENARIO, Parts(WORLD, robot))

    ArrivalMonitor.AddToBuilder(builder, navigation, tolerance=0.2)
    CollisionMonitor.AddToBuilder(builder, robot)
    log = LogVectorOutput(plant.get_state_output_port(arm), builder, 0.01)
    recorder = Recorder.AddToBuilder(builder, navigation, html, SCENARIO)

    simulator = Simulator(builder.Build())
    status = simulator.AdvanceTo(40.0)
    time = simulator.get_context().get_time()
    bent = np.abs(log.FindLog(simulator.get_context()).data()[:3] - POSTURE[:, None]).max()
    said = f"{status.message() or 'out of time'} in {time:.1f} s"
    print(f"{said}; the arm was bent by at most {1e3 * bent:.0f} mrad")
    recorder.finish((said,))
    if png is not None:
        recorder.save(png, 0.5 * time, width=800)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--html", type=Path, metavar="FILE", help="keep the recording")
    parser.add_argument("--png", type=Path, metavar="FILE", help="also draw the middle of the drive")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        main(options.html or Path(folder) / "hall.html", options.png)
