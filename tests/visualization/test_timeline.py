"""The memory of what is drawn agrees with what Meshcat shows."""

from unittest.mock import MagicMock

import numpy as np
import pytest
from pydrake.geometry import Box, Sphere
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.multibody.math import SpatialVelocity
from pydrake.multibody.plant import AddMultibodyPlant, CoulombFriction
from pydrake.multibody.tree import SpatialInertia
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.primitives import ConstantVectorSource

from drake_starnav import Navigation, Recorder, World, parse_scenario
from drake_starnav.station import add_robot, plant_config
from drake_starnav.station.robot_interface import RobotInterface, connect_robot
from drake_starnav.station.world_geometry import OBSTACLE_COLOR, add_ground
from drake_starnav.visualization import meshes
from drake_starnav.visualization.meshcat_stage import MeshcatStage
from drake_starnav.visualization.page import Caption
from drake_starnav.visualization.plot import draw_moment
from drake_starnav.visualization.timeline import RecordedRun, Shape, Solid, Track
from tests.helpers.camera import plotted


@pytest.fixture
def stage() -> MeshcatStage:
    return MeshcatStage(MagicMock(), "/starnav", 0.05)


def visible(stage: MeshcatStage, time: float) -> list[Shape]:
    return list(RecordedRun(Caption(""), (0.0, 0.0, 1.0, 1.0), None, stage.shapes, ()).visible(time).values())


def test_objects_are_there_from_when_they_came_to_when_they_went(stage) -> None:
    for time in (1.0, 2.0):
        stage.swap("path", meshes.make_ribbon(np.array([(0.0, 0.0), (time, 0.0)]), 0.1, 0.0), time)
    stage.swap("path", meshes.NOTHING, 3.0)
    lengths = [[shape.points[:, 0].max() for shape in visible(stage, time)] for time in (0.5, 1.0, 1.9, 2.0, 3.0)]
    assert lengths == [[], [1.0], [1.0], [2.0], []]


def test_points_colours_and_what_is_never_hidden_are_kept(stage) -> None:
    stage.add_points("scan", np.array([(1.0, 2.0), (3.0, 4.0)]), 0.0)
    colors = np.array([(0.1, 0.5, 0.9)] * 4)
    stage.add("trail", meshes.make_segments(np.array([[(0.0, 0.0), (1.0, 0.0)]]), 0.1, 0.0), 0.0, colors=colors)
    scan, trail = visible(stage, 0.0)
    assert scan.points == pytest.approx(np.array([(1.0, 2.0), (3.0, 4.0)]))
    assert scan.faces is None and scan.on_top and not trail.on_top
    assert scan.colors[0] == pytest.approx(meshes.LAYERS["scan"].color)
    assert trail.colors == pytest.approx(colors)


@pytest.mark.parametrize("keep", [True, False])
def test_what_is_removed_is_hidden_or_deleted_and_clearing_deletes_all(keep: bool) -> None:
    stage = MeshcatStage(MagicMock(), "/starnav", 0.05, keep=keep)
    path = stage.add_points("scan", np.zeros((1, 2)), 0.0)
    stage.add_points("scan", np.zeros((1, 2)), 0.0)
    stage.remove(path, 1.0)
    assert len(visible(stage, 1.0)) == 1 and (path in stage.shapes) == keep
    stage.clear()
    assert visible(stage, 1.0) == []


WORLD = World("own", (0.0, 0.0, 0.0), (3.0, 0.0), bounds=(-1.0, -2.0, 4.0, 2.0))
SCENARIO = parse_scenario("world: !Obstacles {}\nlidar: {beams: 36}", name="own")
BLUE, RED = (0.1, 0.2, 0.8), (0.8, 0.1, 0.1)
SPEED, DURATION = 0.5, 1.5
FRICTION = CoulombFriction(0.0, 0.0)
PLACES = {"rack": (2.0, 1.0), "unpainted": (2.0, -1.0), "floor": (3.4, 0.5)}


@pytest.fixture(scope="module")
def recorded(tmp_path_factory):
    """The recorder of a robot that drives straight on beside a rack, a bare box and a ball that slides along y."""
    builder = DiagramBuilder()
    plant, scene_graph = AddMultibodyPlant(plant_config(), builder)
    add_ground(plant, WORLD.extent)
    world = plant.world_body()
    rack, bare = (RigidTransform([*PLACES[name], 0.4]) for name in ("rack", "unpainted"))
    plant.RegisterCollisionGeometry(world, rack, Box(0.6, 0.4, 0.8), "rack", FRICTION)
    plant.RegisterVisualGeometry(world, rack, Box(0.6, 0.4, 0.8), "rack_visual", [*BLUE, 1.0])
    plant.RegisterCollisionGeometry(world, bare, Box(0.6, 0.4, 0.8), "unpainted", FRICTION)
    ball = plant.AddRigidBody("ball", plant.AddModelInstance("ball"), SpatialInertia.SolidSphereWithMass(1.0, 0.2))
    plant.RegisterVisualGeometry(ball, RigidTransform(), Sphere(0.2), "ball_visual", [*RED, 1.0])
    plant.SetDefaultFloatingBaseBodyPose(ball, RigidTransform([1.0, -1.5, 50.0]))  # it falls, seen from above
    model = add_robot(plant, scene_graph, SCENARIO.robot, WORLD.start)
    plant.Finalize()
    robot = builder.AddNamedSystem("robot", RobotInterface(plant, scene_graph, model, SCENARIO))
    connect_robot(builder, plant, scene_graph, model, robot)
    ahead = builder.AddSystem(ConstantVectorSource([SPEED, 0.0]))
    builder.Connect(ahead.get_output_port(), robot.GetInputPort("drive.twist_command"))
    recorder = Recorder(tmp_path_factory.mktemp("own") / "own.html")
    recorder.add_to(builder, Navigation(WORLD, robot))
    simulator = Simulator(builder.Build())
    context = plant.GetMyMutableContextFromRoot(simulator.get_mutable_context())
    plant.SetFreeBodySpatialVelocity(context, ball, SpatialVelocity([0.0, 0.0, 0.0], [0.0, 1.0, 0.0]))
    simulator.AdvanceTo(DURATION)
    recorder.finish()
    return recorder


@pytest.mark.parametrize("time", [0.0, 1.0, DURATION])
def test_still_shows_own_bodies_in_place(recorded, time: float) -> None:
    picture = draw_moment(recorded.recorded, time)
    image = np.asarray(picture, dtype=float) / 255.0
    for place, color in (
        (PLACES["rack"], BLUE),
        (PLACES["unpainted"], OBSTACLE_COLOR[:3]),
        (PLACES["floor"], 1.0),
        ((1.0, -1.5 + time), RED),
    ):
        assert image[plotted(recorded.recorded, place, picture)] == pytest.approx(color, abs=0.02)
    assert recorded.recorded.motions[0].at(time)[:2] == pytest.approx((SPEED * time, 0.0), abs=0.05)


def test_turned_and_hollow_shapes() -> None:
    X_WF = RigidTransform(RotationMatrix.MakeZRotation(np.pi / 2.0), [1.0, 2.0, 0.5])
    corners = np.array([(0.0, 0.0, 0.0), (2.0, 0.0, 0.0), (2.0, 1.0, 0.0), (0.0, 1.0, 0.0)])
    track = Track([0.0], [X_WF.GetAsMatrix34()])
    ((outline,), top) = Solid(corners, None, BLUE, track).project_from_above(3.0)
    assert outline.min(axis=0) == pytest.approx((0.0, 2.0)) and outline.max(axis=0) == pytest.approx((1.0, 4.0))
    assert top == 0.5
    faces = np.array([(0, 1, 2)])
    ((triangle,), _) = Solid(corners, faces, BLUE, track).project_from_above(0.0)
    assert triangle.shape == (3, 2)
