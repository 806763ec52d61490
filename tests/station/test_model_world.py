"""Worlds from Drake model files: what gets into the plant, and what clearance and shortest path know of it."""

import dataclasses
from pathlib import Path

import numpy as np
import pytest
from pydrake.geometry import Role
from pydrake.multibody.plant import AddMultibodyPlantSceneGraph
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder

from drake_starnav import LidarParameters, RobotParameters, Scenario, StarnavError, run_trial
from drake_starnav.scenario.scenario_file import format_scenario, load_scenario, parse_scenario
from drake_starnav.simulation.trial import find_omniscient_path
from drake_starnav.station.model_world import FLOOR_TOLERANCE, add_model, make_world_with_footprints
from drake_starnav.station.navigation_station import NavigationStation, add_station
from drake_starnav.station.plant import add_plant, make_simulator
from drake_starnav.station.world_geometry import make_surface_world
from drake_starnav.worlds import Model, World, compute_clearance
from drake_starnav.worlds.clearance import find_nearest_obstacle
from drake_starnav.worlds.world import ROBOT_HEIGHT

KITCHEN = load_scenario("kitchen").world
RADIUS = 0.25
INERTIAL = '<inertial><mass value="1"/><inertia ixx="0.1" iyy="0.1" izz="0.1" ixy="0" ixz="0" iyz="0"/></inertial>'
BOX = '<collision name="{0}"><origin xyz="{1}" rpy="{2}"/><geometry><box size="{3}"/></geometry></collision>'


def urdf(folder: Path, *links: str, name: str = "m.urdf") -> Path:
    """A model with one link for each list of collision elements, the later ones held by joints to the first."""
    bodies = "".join(f'<link name="l{k}">{INERTIAL}{link}</link>' for k, link in enumerate(links))
    joints = "".join(
        f'<joint name="j{k}" type="revolute"><parent link="l0"/><child link="l{k}"/><axis xyz="0 0 1"/>'
        '<limit lower="-1" upper="1" effort="1" velocity="1"/></joint>'
        for k in range(1, len(links))
    )
    path = folder / name
    path.write_text(f'<robot name="m">{bodies}{joints}</robot>')
    return path


def box(name: str, place: str, size: str, rpy: str = "0 0 0") -> str:
    return BOX.format(name, place, rpy, size)


def world_of(path: Path, **changes) -> World:
    return make_world_with_footprints(Model(directives=str(path), **{"goal": [3.0, 0.0], **changes}), 0, RADIUS)


def test_footprints_are_where_the_collision_geometry_is() -> None:
    """Against Drake's own distance queries: above a point of a footprint, and of no other, there is geometry."""
    world = make_world_with_footprints(KITCHEN, 0, RADIUS)
    builder = DiagramBuilder()
    plant, scene_graph = AddMultibodyPlantSceneGraph(builder, 0.01)
    add_model(plant, scene_graph, world.model)
    plant.Finalize()
    diagram = builder.Build()
    context = scene_graph.GetMyContextFromRoot(diagram.CreateDefaultContext())
    query = scene_graph.get_query_output_port().Eval(context)
    points = np.random.default_rng(0).uniform((-0.2, -0.2), (6.2, 4.2), (400, 2))
    heights = np.linspace(FLOOR_TOLERANCE, ROBOT_HEIGHT, 14)
    for point, distance in zip(points, compute_clearance(world, points), strict=True):
        if abs(distance) > 0.005:  # between the heights that are looked at, and round solids are a hair too wide
            found = [query.ComputeSignedDistanceToPoint([*point, z], 0.0) for z in heights]
            assert any(any(d.distance < 0.0 for d in at) for at in found) == (distance < 0.0), point


def test_the_kitchen_is_crossed() -> None:
    trial = run_trial(load_scenario("kitchen"), seed=3)
    assert trial.outcome == "reached"
    assert trial.min_clearance_m > 0.0
    assert trial.path_length_m < 1.3 * trial.shortest_path_m


def test_what_is_floor_is_left_out_as_there_is_one(tmp_path: Path) -> None:
    path = tmp_path / "m.sdf"
    path.write_text(
        '<sdf version="1.9"><model name="m"><static>true</static><link name="l">'
        '<collision name="plane"><geometry><plane><normal>0 0 1</normal></plane></geometry></collision>'
        '<collision name="slab"><pose>0 0 -0.5 0 0 0</pose><geometry><box><size>20 20 1</size></box></geometry>'
        '</collision><collision name="box"><pose>0 1 0.2 0 0 0</pose><geometry><box><size>1 1 0.4</size></box>'
        "</geometry></collision></link></model></sdf>"
    )
    world = world_of(path)
    assert len(world.polygons) == 1
    station = NavigationStation(world, Scenario("test", None, RobotParameters()))
    inspector = station.scene_graph.model_inspector()
    names = {inspector.GetName(g).split("::")[-1] for g in inspector.GetAllGeometryIds(Role.kProximity)}
    assert names & {"slab", "box", "plane", "ground"} == {"box", "ground"}
    assert [inspector.GetName(g).split("::")[-1] for g in station.floor] == ["ground"]
    scenario = dataclasses.replace(load_scenario("room"), world=Model(directives=str(path), goal=[1.0, 0.0]))
    assert run_trial(scenario).outcome == "reached"


@pytest.mark.parametrize("last", [False, True])
def test_a_plane_stands_among_any_number_of_shapes(tmp_path: Path, last: bool) -> None:
    """Drake's half space ends the process among twenty."""
    bearings = np.linspace(0.0, 2.0 * np.pi, 60, endpoint=False)
    parts = [
        f'<model name="m{k}"><static>true</static><pose>{3.0 * np.cos(a)} {3.0 * np.sin(a)} 0.5 0 0 0</pose><link '
        'name="l"><collision name="c"><geometry><cylinder><radius>0.1</radius><length>1</length></cylinder></geometry>'
        "</collision></link></model>"
        for k, a in enumerate(bearings)
    ]
    plane = '<link name="l"><collision name="c"><geometry><plane/></geometry></collision></link>'
    parts.insert(len(parts) if last else 0, f'<model name="ground_plane"><static>true</static>{plane}</model>')
    path = tmp_path / "m.world"
    path.write_text(f'<sdf version="1.6"><world name="w">{"".join(parts)}</world></sdf>')
    world = world_of(path, goal=[1.0, 0.0])
    assert len(world.cylinders) == 60
    plant, _, _, _ = add_plant(DiagramBuilder(), world, RobotParameters(), 0.01)
    assert plant.is_finalized()


def test_bodies_that_nothing_holds_are_welded_unless_they_shall_move(tmp_path: Path) -> None:
    path = tmp_path / "m.sdf"
    path.write_text(
        '<sdf version="1.9"><model name="m"><pose>1.5 0 0.5 0 0 0</pose><link name="l"><inertial><mass>1</mass>'
        "<inertia><ixx>0.1</ixx><iyy>0.1</iyy><izz>0.1</izz></inertia></inertial>"
        '<collision name="c"><geometry><box><size>0.4 0.4 0.4</size></box></geometry></collision></link></model></sdf>'
    )
    for weld, height in ((True, 0.5), (False, 0.2)):
        world = world_of(path, weld=weld, start=[0.0, 2.0, 0.0])
        assert world.model.moving == (not weld)
        station = NavigationStation(world, Scenario("test", None, RobotParameters()))
        simulator = Simulator(station)
        station.GetInputPort("drive.twist_command").FixValue(simulator.get_mutable_context(), [0.0, 0.0])
        simulator.AdvanceTo(1.0)
        context = station.plant.GetMyContextFromRoot(simulator.get_context())
        pose = station.plant.GetBodyByName("l").EvalPoseInWorld(context)
        assert pose.translation()[2] == pytest.approx(height, abs=0.01)


@pytest.mark.parametrize(("links", "weld", "name"), [(1, False, "l0"), (2, True, "l1"), (3, True, "l1")])
def test_a_link_that_moves_without_mass_is_named(tmp_path: Path, links: int, weld: bool, name: str) -> None:
    path = urdf(tmp_path, *[box("b", "1.5 1 0.5", "0.1 0.1 1")] * links)
    path.write_text(path.read_text().replace(INERTIAL, ""))
    with pytest.raises(StarnavError, match=f"m.urdf: link {name} moves and has no mass; allowed: <inertial>"):
        world_of(path, weld=weld)


def test_there_is_no_shortest_path_among_what_moves(tmp_path: Path) -> None:
    path = urdf(tmp_path, box("post", "1 1 0.5", "0.1 0.1 1"), box("door", "1.5 1 0.5", "0.8 0.05 1"))
    world = world_of(path)
    assert world.model.moving and len(world.polygons) == 1
    assert find_omniscient_path(world, RADIUS) is None


def test_a_mesh_without_dents_bars_what_its_convex_hull_does(tmp_path: Path) -> None:
    (tmp_path / "wedge.obj").write_text(
        "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nv 1 0 1\nv 0 1 1\n"
        "f 1 3 2\nf 4 5 6\nf 1 2 5\nf 1 5 4\nf 2 3 6\nf 2 6 5\nf 3 1 4\nf 3 4 6\n"
    )
    mesh = '<collision name="m"><origin xyz="1 1 0"/><geometry><mesh filename="wedge.obj"/></geometry></collision>'
    world = world_of(urdf(tmp_path, mesh))
    (polygon,) = world.polygons
    assert {tuple(corner) for corner in polygon.round(9)} == {(1.0, 1.0), (2.0, 1.0), (1.0, 2.0)}
    assert world.model.surfaces == ()


def ring(inner: float = 1.0, outer: float = 1.2, height: float = 1.0) -> str:
    """The walls of a square room in one OBJ file."""
    square = np.array([(1, 1), (-1, 1), (-1, -1), (1, -1)])
    points = [(*(size * corner), z) for z in (0.0, height) for size in (inner, outer) for corner in square]
    quads = [(k, (k + 1) % 4, (k + 1) % 4 + 8, k + 8) for k in range(4)]  # the inner side
    quads += [(k + 4, k + 12, (k + 1) % 4 + 12, (k + 1) % 4 + 4) for k in range(4)]
    quads += [(k + z, k + 4 + z, (k + 1) % 4 + 4 + z, (k + 1) % 4 + z) for z in (0, 8) for k in range(4)]
    faces = [(q[0], q[i], q[i + 1]) for q in quads for i in (1, 2)]
    lines = ["v {} {} {}".format(*point) for point in points]
    return "\n".join([*lines, *(f"f {a + 1} {b + 1} {c + 1}" for a, b, c in faces)])


def test_a_hollow_mesh_bars_what_its_surface_does(tmp_path: Path) -> None:
    (tmp_path / "ring.obj").write_text(ring())
    mesh = '<collision name="walls"><geometry><mesh filename="ring.obj"/></geometry></collision>'
    world = world_of(urdf(tmp_path, mesh), start=[-0.6, 0.0, 0.0], goal=[0.6, 0.0])
    assert compute_clearance(world, np.array([(0.0, 0.0), (0.9, 0.3)])) == pytest.approx([1.0, 0.1], abs=1e-3)
    assert not world.model.moving
    builder = DiagramBuilder()
    station = add_station(
        builder, world, Scenario("test", None, RobotParameters(), LidarParameters(noise=0.0, beams=4))
    )
    inspector = station.scene_graph.model_inspector()
    assert not any("walls" in inspector.GetName(g) for g in inspector.GetAllGeometryIds(Role.kProximity))
    simulator = make_simulator(builder.Build())
    port = station.GetOutputPort("lidar.ranges")
    context = port.get_system().GetMyContextFromRoot(simulator.get_mutable_context())
    station.GetInputPort("drive.twist_command").FixValue(context, [0.0, 0.0])
    simulator.AdvanceTo(0.01)
    assert port.Eval(context) == pytest.approx([0.4, 1.0, 1.6, 1.0], abs=1e-3)
    own_builder = DiagramBuilder()
    own, scene = AddMultibodyPlantSceneGraph(own_builder, 0.01)
    add_model(own, scene, world.model)  # also in a plant of one's own
    assert not scene.model_inspector().GetAllGeometryIds(Role.kProximity)
    surfaces = make_surface_world(station.world)
    assert surfaces is not None and find_nearest_obstacle(surfaces, (0.9, 0.3))[1] == pytest.approx(0.1, abs=1e-3)


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("m.urdf", "<robot name='m'><link name='a'>"),
        ("m.sdf", "not xml"),
        ("m.dmd.yaml", "directives:\n- add_modell: {}\n"),
        ("m.dmd.yaml", "directives: [\n"),
        ("m.dmd.yaml", "directives:\n- add_model: {name: m, file: 'package://nobody/m.urdf'}\n"),
        ("m.dmd.yaml", "directives:\n- add_model: {name: m, file: 'file:///nowhere/m.urdf'}\n"),
    ],
)
def test_what_drake_cannot_parse_is_reported_in_one_sentence(tmp_path: Path, name: str, text: str) -> None:
    (tmp_path / name).write_text(text)
    with pytest.raises(StarnavError, match="cannot be read: .*; allowed: ") as error:
        world_of(tmp_path / name)
    assert "\n" not in str(error.value)


INLINE = """
world: !Model {start: [0.6, 0.6, 0.0], goal: [5.4, 3.3]}
directives:
- add_model:
    name: furniture
    file: package://drake_starnav/worlds/furniture.sdf
- add_model: {name: barrel, file: "package://drake_starnav/worlds/barrel.urdf"}
- add_weld:
    parent: world
    child: barrel::barrel
    X_PC: {translation: [3.0, 2.0, 0.0], rotation: !Rpy {deg: [0, 0, 30]}}
"""


def test_directives_may_stand_in_the_scenario() -> None:
    scenario = parse_scenario(INLINE, name="inline")
    world = make_world_with_footprints(scenario.world, 0, 0.25)
    assert len(world.polygons) > 3
    assert any(np.allclose(cylinder[:2], (3.0, 2.0)) for cylinder in world.cylinders)
    assert parse_scenario(format_scenario(scenario), name="inline") == scenario
