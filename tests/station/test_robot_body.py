"""A robot's plant covers its footprint, and nothing beyond it, and its wheels can do what is declared."""

import math
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
import shapely
import trimesh
from pydrake.geometry import Box, Convex, Cylinder, Role, Sphere
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.primitives import TrajectorySource
from pydrake.trajectories import PiecewisePolynomial

from drake_starnav import RobotParameters, Scenario, StarnavError, World, load_scenario
from drake_starnav.station.navigation_station import NavigationStation, add_station
from drake_starnav.station.plant import evaluate_port, make_simulator
from tests.helpers.robots import casters, standing, wheel
from tests.helpers.robots import robot as make_robot

START = (1.0, -2.0, 0.6)
WORLD = World("post", START, (5.0, 0.0), cylinders=[(30.0, 0.0, 0.1)])
ROBOTS = dict.fromkeys(("starbot", "carrier", "jackal"), "differential") | {
    "omnibot": "omnidirectional",
    "carbot": "car",
}


def covered_by_plant(robot: RobotParameters) -> shapely.Geometry:
    """The shadow of all shapes of a robot that touch the post, from what Drake says of them."""
    station = NavigationStation(WORLD, Scenario("test", None, robot))
    context = station.CreateDefaultContext()
    query = station.GetOutputPort("cheat.geometry_query").Eval(context)
    inspector = query.inspector()
    (post,) = (g for g in inspector.GetAllGeometryIds(Role.kProximity) if inspector.GetName(g).endswith("cylinder_0"))
    shadows = []
    for geometry in station.robot_geometries:
        if inspector.CollisionFiltered(geometry, post):
            continue
        shape, X_WG = inspector.GetShape(geometry), query.GetPoseInWorld(geometry)
        if isinstance(shape, Sphere):
            shadows.append(shapely.Point(*X_WG.translation()[:2]).buffer(shape.radius(), 128))
            continue
        if isinstance(shape, Box):
            corners = trimesh.creation.box(shape.size()).vertices
        elif isinstance(shape, Cylinder):
            corners = trimesh.creation.cylinder(shape.radius(), shape.length(), sections=400).vertices
        else:
            assert isinstance(shape, Convex)
            hull = shape.GetConvexHull()
            corners = np.array([hull.vertex(k) for k in range(hull.num_vertices())])
        points = corners @ X_WG.rotation().matrix().T + X_WG.translation()
        shadows.append(shapely.MultiPoint(points[:, :2]).convex_hull)
    return shapely.union_all(shadows)


def declared_area(robot: RobotParameters) -> shapely.Geometry:
    """What a robot's parameters say that it covers at the start, from nothing but their numbers."""
    x, y, yaw = START
    if not robot.footprint:
        return shapely.Point(x, y).buffer(robot.radius, 128)
    parts = robot.footprint if isinstance(robot.footprint[0][0], list) else [robot.footprint]
    whole = shapely.union_all([shapely.Polygon(part) for part in parts])
    turned = shapely.affinity.rotate(whole, yaw, origin=(0, 0), use_radians=True)
    return shapely.affinity.translate(turned, x, y)


def random_robots(count: int, seed: int) -> Iterator[RobotParameters]:
    """Shipped robots with radii, convex polygons and unions of them, about their axis or beside it."""
    rng = np.random.default_rng(seed)
    for k in range(count):
        model, base = list(ROBOTS.items())[k % len(ROBOTS)]
        if rng.uniform() < 0.3:
            yield RobotParameters(model=model, base=base, radius=float(np.exp(rng.uniform(np.log(0.05), np.log(3.0)))))
            continue
        parts = []
        for _ in range(int(rng.integers(1, 4))):
            size, middle = np.exp(rng.uniform(np.log(0.05), np.log(1.5), 2)), rng.normal(0.0, 0.15, 2)
            if rng.uniform() < 0.5:
                corners = size * np.array(((1, 1), (-1, 1), (-1, -1), (1, -1))) + middle
            else:
                angle = np.sort(rng.uniform(-math.pi, math.pi, int(rng.integers(3, 9))))
                corners = size * np.column_stack((np.cos(angle), np.sin(angle))) + middle
            parts.append(corners.round(4).tolist())
        try:
            robot = RobotParameters(model=model, base=base, footprint=parts if len(parts) > 1 else parts[0])
        except StarnavError:  # a sliver
            continue
        yield robot


def test_random_bodies_are_what_is_declared() -> None:
    """Each robot that is accepted covers its footprint and no more."""
    accepted = 0
    for robot in random_robots(40, seed=2):
        try:
            plant = covered_by_plant(robot)
        except StarnavError as error:
            assert "has no room for link" in str(error) or "its wheels turn it" in str(error)
            continue
        declared, accepted = declared_area(robot), accepted + 1
        flat = 0.0022 * robot.radius if robot.base == "car" and not robot.footprint else 0.0  # a disc of 48 corners
        assert shapely.hausdorff_distance(plant, declared) < 2e-3 + flat, robot
        assert declared.buffer(1e-3).covers(plant), robot
    assert accepted > 20


@pytest.mark.slow
@pytest.mark.parametrize("base", ["differential", "car"])
def test_a_robot_of_ones_own_has_the_shape_of_its_model_as_a_car_too(base: str) -> None:
    own = Path(__file__).parents[1] / "data" / "small_base.urdf"
    limits = ["robot.max_acceleration=0.1", "robot.max_yaw_acceleration=0.1"]
    overrides = [f"robot.model={own}", f"robot.base={base}", *limits]
    assert 0.02 < load_scenario("room", overrides=overrides).robot.shape.radius < 0.5


@pytest.mark.parametrize("name", ["max_acceleration", "max_deceleration"])
def test_a_robot_whose_wheels_cannot_do_what_is_declared_is_refused(name: str) -> None:
    """By what it weighs and the efforts of its wheels; with the figure."""
    robot = RobotParameters(**{"model": "jackal", "radius": 0.334, name: 20.0})
    with pytest.raises(StarnavError, match=rf"push it with at most .* m/s\^2, and robot.{name} is 20 m/s\^2; allowed"):
        NavigationStation(WORLD, Scenario("test", None, robot))


@pytest.mark.parametrize(
    ("said", "words"),
    [
        ({"radius": 0.04}, "robot.radius is 0.04 m, which has no room for link .* of starbot; allowed: a body that"),
        ({"footprint": [[1, 1], [2, 1], [2, 2], [1, 2]]}, r"robot.footprint is .* has no room for link .*"),
    ],
)
def test_a_body_without_room_for_the_wheels_is_refused(said: dict, words: str) -> None:
    with pytest.raises(StarnavError, match=words):
        NavigationStation(WORLD, Scenario("test", None, RobotParameters(**said)))


@pytest.mark.parametrize(("model", "radius"), [("starbot", 1.0), ("carrier", 3.0), ("jackal", 3.0), ("carbot", 1.0)])
def test_the_lidar_of_a_large_body_sees_no_floor_where_it_brakes(model: str, radius: float) -> None:
    """Up to 60 m, however hard it turns and stops: what stands on the wheels and casters grows with the body."""
    asked = {"radius": radius, "max_speed": 3.0, "max_acceleration": 3.0, "max_yaw_acceleration": 1.0}
    builder = DiagramBuilder()
    scenario = Scenario("test", None, RobotParameters(model=model, base=ROBOTS[model], **asked))
    station = add_station(builder, WORLD, scenario, continuous=True)
    twists = np.array(((3.0, 0.0, -3.0, 0.0, 0.0), (0.0, 0.0, 0.3, 0.0, 0.0)))
    command = builder.AddSystem(TrajectorySource(PiecewisePolynomial.ZeroOrderHold(np.arange(5.0), twists)))
    builder.Connect(command.get_output_port(), station.GetInputPort("drive.twist_command"))
    simulator = make_simulator(builder.Build())
    lowest = np.inf
    for time in np.arange(0.003, 4.0, 0.02):  # never at a scan, from which it would differ by rounding
        simulator.AdvanceTo(time)
        X_WS = evaluate_port(station.GetOutputPort("lidar.X_WS"), simulator.get_context())
        lowest = min(lowest, X_WS.translation()[2] - 60.0 * np.hypot(*X_WS.rotation().matrix()[2, :2]))
    assert lowest > 0.0


def test_a_robot_does_not_tip_over_wherever_its_body_lies() -> None:
    """Its centre of mass was left ahead of casters that are drawn in towards the axle."""
    corners = [[0.08, -0.2], [0.08, 0.3], [-0.28, 0.3], [-0.28, -0.2]]
    station = NavigationStation(WORLD, Scenario("test", None, RobotParameters("carbot", base="car", footprint=corners)))
    simulator = make_simulator(station)
    station.GetInputPort("drive.twist_command").FixValue(simulator.get_mutable_context(), np.zeros(2))
    simulator.AdvanceTo(0.5)
    X_WS = evaluate_port(station.GetOutputPort("lidar.X_WS"), simulator.get_context())
    assert X_WS.rotation().matrix()[2, 2] > 0.9999


WINGS = [
    [[0.16, 1.2], [0.03, 1.2], [0.03, -1.17], [0.16, -1.17]],
    [[0.69, 0.045], [-0.44, 0.045], [-0.44, -0.15], [0.69, -0.15]],
]
"""Wheels that stand within this body are 5 cm apart."""
CART = make_robot(wheel("left", 0.0, 0.1), wheel("right", 0.0, -0.1), casters(0.15))


@pytest.mark.parametrize("body", [{"footprint": WINGS}, {"radius": 0.085}], ids=["between wings", "in a small disc"])
def test_a_shipped_robot_whose_wheels_come_too_close_to_turn_it_is_refused(body) -> None:
    """It would turn on where it is certified to have stopped."""
    robot = RobotParameters(model="carrier", max_yaw_acceleration=3.0, **body)
    with pytest.raises(StarnavError, match="its wheels turn it with at most [12][.][0-9]+ rad/s"):
        NavigationStation(WORLD, Scenario("test", None, robot))


def test_a_cart_turns_as_its_wheels_grip(tmp_path) -> None:
    standing(tmp_path, CART, max_yaw_acceleration=4.0)


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ('<inertia ixx="0.06" iyy="0.06" izz="0.06"', '<inertia ixx="60" iyy="60" izz="60"'),
        ('<axis xyz="0 0 1"/>', '<axis xyz="0 0 1"/><limit effort="0.01" velocity="20"/>'),
    ],
    ids=["inertia of a design program", "weak motors"],
)
def test_what_keeps_a_cart_from_turning_is_said(tmp_path, old: str, new: str) -> None:
    assert old in CART
    with pytest.raises(StarnavError, match="its wheels turn it with at most .*; allowed: .*effort .*inertia"):
        standing(tmp_path, CART.replace(old, new), max_yaw_acceleration=4.0)
