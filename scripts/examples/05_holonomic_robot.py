"""A holonomic robot without wheels follows the guiding vector; our twists are not used.

The robot is a puck on two sliding joints that moves in any direction without turning. The package does not know it:
the lidar is mounted on its body, perception and planner get its pose, and of the controller's outputs only
`guiding_vector` is connected.

Run: python scripts/examples/05_holonomic_robot.py [--png FILE]
"""

import argparse
from pathlib import Path

import numpy as np
from pydrake.math import RigidTransform
from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import AddMultibodyPlant
from pydrake.multibody.tree import PdControllerGains
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.primitives import (
    FirstOrderLowPassFilter,
    LogVectorOutput,
    MatrixGain,
)

from drake_starnav import (
    ArrivalMonitor,
    CollisionMonitor,
    DsmController,
    FixedGoal,
    LidarMount,
    LidarSensor,
    StarPerception,
    StarRoadmapPlanner,
    derive_margins,
    load_scenario,
    make_world,
)
from drake_starnav.plotting import draw_goal, draw_robot, save_figure, world_axes
from drake_starnav.station import add_world, plant_config

BLUE = "#0072B2"
STEP = 0.005  # of the plant, s
SPEED = 0.6  # m/s
PUCK = """
<robot name="puck">
  <link name="beam">
    <inertial><mass value="0.1"/><inertia ixx="0.1" iyy="0.1" izz="0.1" ixy="0" ixz="0" iyz="0"/></inertial>
  </link>
  <link name="puck">
    <inertial><mass value="2"/><inertia ixx="0.1" iyy="0.1" izz="0.1" ixy="0" ixz="0" iyz="0"/></inertial>
    <collision name="hull"><geometry><cylinder radius="0.25" length="0.1"/></geometry></collision>
  </link>
  <joint name="x" type="prismatic">
    <parent link="world"/><child link="beam"/><origin xyz="0 0 0.1"/><axis xyz="1 0 0"/><limit effort="50"/>
  </joint>
  <joint name="y" type="prismatic">
    <parent link="beam"/><child link="puck"/><axis xyz="0 1 0"/><limit effort="50"/>
  </joint>
  <transmission><type>SimpleTransmission</type><joint name="x"/><actuator name="x"/></transmission>
  <transmission><type>SimpleTransmission</type><joint name="y"/><actuator name="y"/></transmission>
</robot>
"""


def main(png: Path | None) -> None:
    """Drive the puck through a forest."""
    scenario = load_scenario("forest", overrides=["world.width=12", "world.height=6"])
    world = make_world(scenario.world, 3, scenario.robot.radius)
    builder = DiagramBuilder()
    plant, scene_graph = AddMultibodyPlant(plant_config(STEP), builder)
    add_world(plant, world)
    (model,) = Parser(plant).AddModelsFromString(PUCK, "urdf")
    for name, position in zip("xy", world.start, strict=False):
        plant.GetJointActuatorByName(name).set_controller_gains(PdControllerGains(p=0.0, d=500.0))
        plant.GetJointByName(name).set_default_translation(position)
    plant.Finalize()
    body = plant.GetBodyFrameIdOrThrow(plant.GetBodyByName("puck").index())

    robot, lidar_parameters, margins = scenario.robot, scenario.lidar, derive_margins(scenario)
    lidar = builder.AddSystem(LidarSensor(lidar_parameters, LidarMount(body, RigidTransform())))
    pose = builder.AddSystem(MatrixGain(np.eye(3, 4) * [[1], [1], [0]]))  # of (x, y, v_x, v_y): it never turns
    state = builder.AddSystem(MatrixGain(np.eye(5, 4) * [[1], [1], [0], [0], [0]]))
    goal = builder.AddSystem(FixedGoal(world.goal))
    perception = builder.AddSystem(StarPerception(robot, margins, lidar_parameters))
    planner = builder.AddSystem(StarRoadmapPlanner(robot, scenario.planner, margins))
    controller = builder.AddSystem(DsmController(robot, scenario.controller, margins))
    speed = builder.AddSystem(MatrixGain(SPEED * np.eye(4, 2, -2)))  # (0, 0, v_x, v_y), as the servos want it
    smooth = builder.AddSystem(FirstOrderLowPassFilter(0.1, 2))
    arrival = builder.AddSystem(ArrivalMonitor(tolerance=0.1, period=0.02))
    hull = plant.GetCollisionGeometriesForBody(plant.GetBodyByName("puck"))
    collision = builder.AddSystem(CollisionMonitor(robot=hull, ground=[]))
    for source, port in (
        (scene_graph.get_query_output_port(), lidar.GetInputPort("geometry_query")),
        (plant.get_state_output_port(model), pose.get_input_port()),
        (plant.get_state_output_port(model), state.get_input_port()),
        (lidar.GetOutputPort("scan"), perception.GetInputPort("scan")),
        (lidar.GetOutputPort("pose"), perception.GetInputPort("pose")),
        (perception.GetOutputPort("observation"), planner.GetInputPort("observation")),
        (pose.get_output_port(), planner.GetInputPort("pose")),
        (goal.get_output_port(), planner.GetInputPort("goal")),
        (planner.GetOutputPort("guidance"), controller.GetInputPort("guidance")),
        (perception.GetOutputPort("surroundings"), controller.GetInputPort("surroundings")),
        (state.get_output_port(), controller.GetInputPort("state")),
        (controller.GetOutputPort("guiding_vector"), smooth.get_input_port()),
        (smooth.get_output_port(), speed.get_input_port()),
        (speed.get_output_port(), plant.get_desired_state_input_port(model)),
        (state.get_output_port(), arrival.GetInputPort("state")),
        (goal.get_output_port(), arrival.GetInputPort("goal")),
        (scene_graph.get_query_output_port(), collision.GetInputPort("geometry_query")),
    ):
        builder.Connect(source, port)
    log = LogVectorOutput(state.get_output_port(), builder, 0.05)

    simulator = Simulator(builder.Build())
    status = simulator.AdvanceTo(60.0)
    context = simulator.get_context()
    trail = log.FindLog(context).data()
    length = np.hypot(*np.diff(trail[:2])).sum()
    print(f"{status.message() or 'out of time'} at {context.get_time():.2f} s after {length:.2f} m, without a turn")
    if png is not None:
        figure, axis = world_axes(world, "A holonomic robot on the guiding vector")
        axis.plot(*trail[:2], color=BLUE, label="driven")
        for pose_then in trail[:3, :: len(trail.T) // 6].T:
            draw_robot(axis, pose_then, robot.radius, BLUE)
        draw_goal(axis, world.goal)
        save_figure(figure, png)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--png", type=Path, metavar="FILE", help="also draw what happened")
    main(parser.parse_args().png)
