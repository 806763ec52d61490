"""A robot is what has the ports, the mounts and the declarations: a plant is not asked for."""

import dataclasses
import itertools
import math

import numpy as np
import pytest
from pydrake.common.value import Value
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import BasicVector, DiagramBuilder, EventStatus, LeafSystem

from drake_starnav import Parts, StarnavError, add_navigation, load_scenario, make_world, parse_scenario
from drake_starnav.lidar.mounts import ON_AXIS
from drake_starnav.navigation.robot import robot_world
from drake_starnav.systems import release
from drake_starnav.worlds.view import scan_from, visible_shapes
from tests.helpers.robots import casters, joint, link, robot, wheel

FOREST = load_scenario("forest")
WORLD = make_world(FOREST.world, 0, FOREST.robot.radius)


class Puck(LeafSystem):
    """Follows its twists exactly."""

    def __init__(self, scenario, world) -> None:
        super().__init__()
        self.scenario, self.mounts, self.shapes = scenario, (ON_AXIS,), visible_shapes(world)
        self.twist = self.DeclareVectorInputPort("drive.twist_command", 2)
        seen = scan_from(self.shapes, world.start, scenario.lidar, 0, 0), np.array(world.start)
        pose, self.seen = self.DeclareContinuousState(BasicVector(world.start)), self.DeclareAbstractState(Value(seen))
        self.DeclareStateOutputPort("localization.pose", pose)
        self.DeclareVectorOutputPort("localization.state", 5, self.calc_state)
        once = {self.abstract_state_ticket(self.seen)}
        self.DeclareAbstractOutputPort("lidar.scan", lambda: Value(seen[0]), self.calc_scan, once)
        self.DeclareVectorOutputPort("localization.scan_pose", 3, self.calc_scan_pose, once)
        self.DeclarePeriodicUnrestrictedUpdateEvent(1.0 / scenario.lidar.rate, 0.0, self.look)

    def look(self, context, state):
        pose = context.get_continuous_state_vector().CopyToVector()
        scan = scan_from(
            self.shapes, pose, self.scenario.lidar, 0, round(context.get_time() * self.scenario.lidar.rate)
        )
        state.get_mutable_abstract_state(self.seen).set_value((scan, pose))
        return EventStatus.Succeeded()

    def calc_scan(self, context, output):
        output.set_value(context.get_abstract_state(self.seen).get_value()[0])

    def calc_scan_pose(self, context, output):
        output.SetFromVector(context.get_abstract_state(self.seen).get_value()[1])

    def calc_state(self, context, output):
        pose = context.get_continuous_state_vector().CopyToVector()
        output.SetFromVector(np.append(pose, self.twist.Eval(context)))

    def DoCalcTimeDerivatives(self, context, derivatives):
        (_, _, yaw), (v, omega) = context.get_continuous_state_vector().CopyToVector(), self.twist.Eval(context)
        derivatives.get_mutable_vector().SetFromVector((v * math.cos(yaw), v * math.sin(yaw), omega))


def driven(scenario, world, seconds: float) -> float:
    """How far a robot without a plant comes."""
    builder = DiagramBuilder()
    puck = builder.AddSystem(Puck(scenario, world))
    navigation = add_navigation(builder, scenario, Parts(None if world is EMPTY else world, puck))
    diagram = builder.Build()
    simulator = Simulator(diagram)
    simulator.AdvanceTo(seconds)
    pose = navigation.localization("pose").Eval(puck.GetMyContextFromRoot(simulator.get_context())).copy()
    release(diagram)
    return math.dist(pose[:2], world.start[:2])


EMPTY = dataclasses.replace(WORLD, cylinders=np.zeros((0, 3)), start=(0.0, 0.0, 0.0), goal=(1.0, 0.0), bounds=None)


def test_a_system_of_thirty_lines_drives() -> None:
    assert driven(FOREST, WORLD, 4.0) > 1.5


def test_a_scenario_of_a_robot_that_is_not_simulated_needs_no_world() -> None:
    scenario = parse_scenario("robot: {max_speed: 0.5}", name="mine")
    assert scenario.world is None
    assert driven(scenario, EMPTY, 2.0) > 0.2


def test_its_declarations_must_be_the_scenario_s() -> None:
    builder = DiagramBuilder()
    puck = builder.AddSystem(Puck(FOREST, WORLD))
    other = load_scenario("forest", overrides=["drive.delay=0.1"])
    with pytest.raises(StarnavError, match=r"drive\.delay 0\.0, the scenario 0\.1"):
        add_navigation(builder, other, Parts(WORLD, puck))


def table_world(folder, mast: float, overhangs: str = "") -> tuple[int, int]:
    """How many discs and polygons of a table 0.6 m high bar the way of a robot with a mast so high, m."""
    legs = "".join(
        f'<collision name="leg_{k}"><pose>{x} {y} 0.3 0 0 0</pose><geometry><cylinder><radius>0.03</radius>'
        "<length>0.6</length></cylinder></geometry></collision>"
        for k, (x, y) in enumerate(itertools.product((2.0, 4.0), (-1.0, 1.0)))
    )
    top = (
        '<collision name="top"><pose>3 0 0.62 0 0 0</pose><geometry><box><size>2.2 2.2 0.04</size></box></geometry>'
        "</collision>"
    )
    (folder / "table.sdf").write_text(
        f'<sdf version="1.9"><model name="a"><static>true</static><link name="link">{legs}{top}</link></model></sdf>'
    )
    mast_link = link("mast", '<box size="0.04 0.04 0.2"/>') + joint("mast", (0.0, 0.0, mast - 0.1 - 0.06))
    wheels = wheel("left", 0.0, 0.15) + wheel("right", 0.0, -0.15)
    (folder / "tall.urdf").write_text(robot(wheels, casters(-0.15, 0.15), mast_link))
    text = f"world: !Model {{directives: {folder / 'table.sdf'}, start: [0.5, 0, 0], goal: [6, 0]}}\n"
    text += f"robot: {{model: {folder / 'tall.urdf'}, radius: 0.3, overhangs: '{overhangs}'}}\n"
    world = robot_world(parse_scenario(text, name="table"), 0)
    return len(world.cylinders), len(world.polygons)


def test_what_stands_no_higher_than_the_robot_bars_its_way(tmp_path) -> None:
    assert table_world(tmp_path, 0.4) == (4, 0)
    assert table_world(tmp_path, 0.7) == (4, 1)
    assert table_world(tmp_path, 0.9, overhangs="mast") == (4, 0)


def test_of_a_ball_as_much_counts_as_the_robot_reaches(tmp_path) -> None:
    heights = {}
    for model in ("starbot", "jackal"):
        scenario = parse_scenario(f"world: !Maze {{family: open}}\nrobot: {{model: {model}}}", name="balls")
        world = robot_world(scenario, 1)
        heights[model] = world.height
        radius = world.spheres[:, 2]
        low = np.maximum(radius - world.height, 0.0)
        np.testing.assert_allclose(world.discs[len(world.cylinders) :, 2], np.sqrt(radius**2 - low**2))
    assert heights["starbot"] == pytest.approx(0.13) and heights["jackal"] > 0.15
