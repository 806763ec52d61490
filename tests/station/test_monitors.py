"""The run ends at the first contact with an obstacle; the ground may be touched."""

import math

import numpy as np
import pytest
from pydrake.geometry import ProximityProperties, Sphere
from pydrake.math import RigidTransform
from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import AddMultibodyPlantSceneGraph
from pydrake.multibody.tree import SpatialInertia
from pydrake.systems.analysis import Simulator, SimulatorStatus
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.primitives import ConstantVectorSource

from drake_starnav import LidarParameters, RobotParameters, Scenario, World, make_simulator
from drake_starnav.geometry.footprint import disc, footprint
from drake_starnav.station import world_geometry
from drake_starnav.station.monitors import CollisionMonitor, Hull, find_contact, name_body
from drake_starnav.station.navigation_station import NavigationStation, add_station
from drake_starnav.worlds.moving_obstacles import MovingObstacles

ROBOT = RobotParameters()
TOUCHED = SimulatorStatus.ReturnReason.kReachedTerminationCondition
SPEED = 0.5
STEP = 0.005  # of the plant, s


class Run:
    """A station that is driven by a constant twist under a monitor."""

    def __init__(self, twist=(SPEED, 0.0), start=(0.0, 0.0, 0.0), footprint=None, told=False, **bars) -> None:
        world = World("test", start, (1.0, 0.0), **bars)
        surfaces = world_geometry.make_surface_world(world)
        builder = DiagramBuilder()
        self.station = builder.AddSystem(
            NavigationStation(world, Scenario("test", None, ROBOT, LidarParameters(beams=3)))
        )
        source = builder.AddSystem(ConstantVectorSource(twist))
        self.monitor = builder.AddSystem(
            CollisionMonitor(
                robot=self.station.robot_geometries,
                ground=[self.station.ground],
                moving_obstacles=self.station.moving_obstacle_geometries,
                hull=None if surfaces is None else Hull(self.station.robot_interface.base_frame, surfaces),
                footprint=footprint or ROBOT.shape,
                near=(world, self.station.robot_interface.reach) if told else None,
                period=STEP,
            )
        )
        builder.Connect(self.station.GetOutputPort("localization.state"), self.monitor.GetInputPort("state"))
        builder.Connect(source.get_output_port(), self.station.GetInputPort("drive.twist_command"))
        builder.Connect(self.station.GetOutputPort("cheat.geometry_query"), self.monitor.GetInputPort("geometry_query"))
        self.simulator = Simulator(builder.Build())
        self.context = self.simulator.get_context()

    def until(self, time: float) -> SimulatorStatus:
        return self.simulator.AdvanceTo(time)

    def contacts(self) -> list:
        return self.monitor.contacts(self.monitor.GetMyContextFromRoot(self.context))

    def name(self, geometry) -> str:
        return self.station.scene_graph.model_inspector().GetName(geometry).split("::")[-1]


@pytest.mark.parametrize(
    ("name", "obstacles", "gap"),
    [
        ("cylinder_0", {"cylinders": [(1.0, 0.05, 0.3)]}, 0.45),
        ("sphere_0", {"spheres": [(1.0, 0.0, 0.3)]}, 0.45),
        ("polygon_0_0", {"polygons": ([(0.8, -0.5), (1.2, -0.5), (1.2, 0.5), (0.8, 0.5)],)}, 0.55),
        ("polygon_0_0", {"polygons": ([(0.8, -0.5), (1.2, 0.0), (0.8, 0.5)],)}, 0.55),
        ("wall_east", {"bounds": (-1.0, -1.0, 0.8, 1.0)}, 0.55),
    ],
)
@pytest.mark.parametrize(("told", "footprint"), [(False, None), (True, None), (True, disc(0.1))])
def test_ends_at_the_contact_with_an_obstacle(name, obstacles, gap, told, footprint) -> None:
    """Also where more of the robot collides than its footprint covers, as what swings above it."""
    run = Run(told=told, footprint=footprint, **obstacles)
    assert run.until(0.8 * gap / SPEED).reason() != TOUCHED
    assert run.contacts() == []
    status = run.until(5.0)
    assert status.reason() == TOUCHED
    # the robot takes a moment to gain speed
    assert gap / SPEED < run.context.get_time() + 0.02 < gap / SPEED + 0.2
    ((hull, obstacle),) = run.contacts()
    assert run.name(hull) == "hull"
    assert run.name(obstacle) == name
    assert status.message() == f"collision of base_link with {name} at {run.context.get_time():.3f} s"
    assert find_contact(status.message()) == f"base_link with {name}"


@pytest.mark.parametrize("angle", [0.0, 0.3])
def test_ends_at_the_contact_with_a_surface(angle: float, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(world_geometry, "MOST_POLYGONS", 1)
    behind = [(-3.0, -1.0), (-2.0, 0.0), (-3.0, 1.0)]
    ahead = np.array([(0.8, -0.5), (1.2, -0.5), (1.2, 0.5), (0.8, 0.5)])
    run = Run(start=(0.0, 0.0, angle), polygons=(behind, ahead))
    gap = (0.8 - ROBOT.radius) / math.cos(angle)
    assert run.until(0.8 * gap / SPEED).reason() != TOUCHED
    status = run.until(5.0)
    assert status.reason() == TOUCHED
    assert status.message().startswith("collision of base_link with polygons[1] at ")
    assert gap / SPEED < run.context.get_time() + 0.02 < gap / SPEED + 0.2


@pytest.mark.parametrize("twist", [(0.8, 0.0), (0.5, 2.0), (0.0, -2.0), (-0.5, 0.5)])
def test_the_ground_is_touched_all_the_time_and_never_counts(twist) -> None:
    run = Run(twist)
    assert run.until(1.5).reason() != TOUCHED
    results = run.station.GetOutputPort("cheat.contact_results").Eval(run.station.GetMyContextFromRoot(run.context))
    assert results.num_point_pair_contacts() >= 2
    assert run.contacts() == []


def approaching(speed: float, angle: float, gap: float = 0.5) -> MovingObstacles:
    """A disc that comes from a bearing straight towards the robot at the origin, its rim `gap` from the hull."""
    from_robot = np.array([math.cos(angle), math.sin(angle)])
    begin, end = ((ROBOT.radius + 0.3 + far) * from_robot for far in (gap, gap - 10.0 * speed))
    return MovingObstacles([0.3], ([(0.0, *begin), (10.0, *end)],))


@pytest.mark.parametrize("angle", [0.0, 1.0, math.pi])
@pytest.mark.parametrize("speed", [0.3, 0.8, 2.0])
def test_a_robot_that_stands_in_the_way_is_struck(speed: float, angle: float) -> None:
    run = Run((0.0, 0.0), moving_obstacles=approaching(speed, angle))
    status = run.until(5.0)
    assert status.reason() == TOUCHED
    assert status.message().startswith("struck on base_link by moving_obstacles::moving_obstacle_0 at ")
    assert find_contact(status.message()) == "base_link with moving_obstacles::moving_obstacle_0"
    assert run.context.get_time() == pytest.approx(0.5 / speed, abs=2.1 * STEP)
    ((hull, obstacle),) = run.contacts()
    assert (run.name(hull), run.name(obstacle)) == ("hull", "moving_obstacle_0")


@pytest.mark.parametrize("twist", [(0.5, 0.0), (-0.3, 1.0), (0.05, 0.0)])
def test_a_robot_that_drives_when_it_meets_a_moving_obstacle_has_a_collision(twist) -> None:
    status = Run(twist, moving_obstacles=approaching(0.3, 0.0 if twist[0] > 0.0 else math.pi)).until(5.0)
    assert status.reason() == TOUCHED
    assert status.message().startswith("collision of ")


@pytest.mark.parametrize(("lever", "name"), [(0.0, "struck"), (ROBOT.radius, "collision")])
def test_a_polygon_that_turns_on_the_spot_moves_and_a_disc_stands(lever: float, name: str) -> None:
    edge = lever / math.sqrt(2.0)
    square = footprint(((edge, edge), (-edge, edge), (-edge, -edge), (edge, -edge))) if lever else disc(ROBOT.radius)
    status = Run((0.0, 1.0), footprint=square, moving_obstacles=approaching(0.8, 0.3)).until(5.0)
    assert status.message().startswith(name)


def test_who_stands_against_a_wall_has_a_collision() -> None:
    """What a robot has driven into by itself is no matter of moving obstacles."""
    run = Run((0.0, 0.0), bounds=(-1.0, -1.0, ROBOT.radius - 0.0005, 1.0), moving_obstacles=approaching(0.5, 2.0))
    status = run.until(0.1)
    assert status.message().startswith("collision of ")


@pytest.mark.parametrize("depth", [3e-4, 1e-3])
def test_no_contact_is_too_short(depth: float) -> None:
    """The hull passes a thin post at full speed, in touch for some hundredths of a second."""
    builder = DiagramBuilder()
    world = World("post", (0.0, 0.0, 0.0), (2.0, 0.0), cylinders=[(1.0, ROBOT.radius + 0.01 - depth, 0.01)])
    station = add_station(builder, world, Scenario("test", None, ROBOT, LidarParameters(beams=3)))
    CollisionMonitor.AddToBuilder(builder, station)
    source = builder.AddSystem(ConstantVectorSource((0.8, 0.0)))
    builder.Connect(source.get_output_port(), station.GetInputPort("drive.twist_command"))
    simulator = make_simulator(builder.Build())
    assert simulator.AdvanceTo(3.0).reason() == TOUCHED
    assert simulator.get_context().get_time() < 1.6


def test_bodies_are_called_as_a_person_calls_them() -> None:
    builder = DiagramBuilder()
    plant, scene_graph = AddMultibodyPlantSceneGraph(builder, 0.001)
    names, inertia = {}, SpatialInertia.SolidSphereWithMass(1.0, 0.2)

    def add(body, expected: str) -> None:
        shape = plant.RegisterCollisionGeometry(
            body, RigidTransform(), Sphere(0.2), f"s{len(names)}", ProximityProperties()
        )
        names[shape] = expected

    add(plant.AddRigidBody("loose", inertia), "loose")
    crate = '<sdf version="1.7"><model name="crate"><link name="crate"/><link name="lid"/></model></sdf>'
    for prefix, parser in (("", Parser(plant)), ("left::", Parser(plant, "left"))):
        (model,) = parser.AddModelsFromString(crate, "sdf")
        add(plant.GetBodyByName("crate", model), f"{prefix}crate")
        add(plant.GetBodyByName("lid", model), f"{prefix}crate::lid")
    add(plant.world_body(), "s5")
    plant.Finalize()
    assert {g: name_body(scene_graph.model_inspector(), g) for g in names} == names
