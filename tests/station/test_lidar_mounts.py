"""Lidars of a robot's model: where they are, what is asked of their frames, and that the robot drives with them."""

import dataclasses
import math
from pathlib import Path

import numpy as np
import pytest
from pydrake.common.yaml import yaml_dump_typed, yaml_load_typed
from pydrake.geometry import Box, ProximityProperties, Sphere
from pydrake.math import RigidTransform, RollPitchYaw
from pydrake.multibody.plant import AddMultibodyPlantSceneGraph, CoulombFriction
from pydrake.multibody.tree import SpatialInertia
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder

from drake_starnav.errors import StarnavError
from drake_starnav.lidar.mounts import ON_AXIS, Mount, align_with_robot
from drake_starnav.lidar.sensor_model import LidarParameters
from drake_starnav.loading import load_scenario, parse_scenario
from drake_starnav.navigation import make_diagram
from drake_starnav.scenario.error_budget import evaluate_error_budget
from drake_starnav.scenario.schema import Scenario
from drake_starnav.simulation.run import run_trial
from drake_starnav.station.lidar_mounts import ApplyLidarConfig, LidarConfig, find_mount
from drake_starnav.station.navigation_station import NavigationStation
from drake_starnav.utils.resources import find_model_path
from drake_starnav.worlds import World, moving_obstacle_states

FRAMES = {
    "ahead": ("0.2 0 0.08", "0 0 0"),
    "behind": ("-0.2 0 0.08", "0 0 2.5"),
    "top_laser": ("0.1 0.05 0.08", "3.141592653589793 0 0.5"),
    "tilted": ("0 0 0.08", "0 0.1 0"),
    "right": ("0.16 -0.16 0.08", "0 0 -0.7853981633974483"),
    "left": ("-0.16 0.16 0.08", "0 0 2.356194490192345"),
}
LIMITED = ("lidar.beams=271", "lidar.angle_min=-2.356194490192345", "lidar.angle_max=2.356194490192345")
NARROW = ("lidar.beams=181", "lidar.angle_min=-1.2", "lidar.angle_max=1.2")
CORNERS = (*LIMITED, "lidars=[{frame: right}, {frame: left}]")
OPEN = World("open", (1.0, -2.0, 0.6), (5.0, 0.0), cylinders=[(2.0, -2.0, 0.3), (0.2, -1.6, 0.1), (1.0, 0.0, 0.5)])
TEXT = """
name: front
beams: 4
noise: 0
X_PS:
  base_frame: cart::mast
  translation: [0, 0, 0.5]
  rotation: !Rpy {deg: [0, 0, 90]}
"""


@pytest.fixture(scope="module")
def model(tmp_path_factory: pytest.TempPathFactory) -> str:
    """Override for starbot with more frames."""
    path = tmp_path_factory.mktemp("robot") / "mounted.urdf"
    return with_frames("starbot", path, FRAMES)


def with_frames(name: str, path: Path, frames: dict[str, tuple[str, str]]) -> str:
    """Override for a shipped robot with more frames, written to a path."""
    text = find_model_path("robots", f"{name}.urdf").read_text(encoding="utf-8")
    more = [f'<frame name="{n}" link="base_link" xyz="{xyz}" rpy="{rpy}"/>' for n, (xyz, rpy) in frames.items()]
    path.write_text(text.replace("</robot>", "".join((*more, "</robot>"))), encoding="utf-8")
    return f"robot.model={path}"


def scenario(*overrides: str, world: str = "!Obstacles {}") -> Scenario:
    return parse_scenario(f"world: {world}\nlidar: {{noise: 0}}", name="mounted", overrides=overrides)


def standing(*overrides: str) -> NavigationStation:
    """A station in which the robot stands among posts."""
    return NavigationStation(OPEN, scenario(*overrides))


def test_the_mount_follows_from_the_pose_of_the_frame() -> None:
    turned = RigidTransform(RollPitchYaw(math.pi, 0.0, 0.5), [0.1, 0.2, 0.3])
    assert mount(turned) == pytest.approx(Mount(0.1, 0.2, 0.5, True), abs=1e-9)
    assert mount(RigidTransform([5e-4, 0.0, 0.3])) == ON_AXIS
    assert mount(RigidTransform(RollPitchYaw(0.0, 0.0, 5e-4), [0.1, 0.0, 0.3])) == Mount(0.1, 0, 0, False)


def mount(X_BS: RigidTransform, range_max: float = 5.0, height: float = 0.3) -> Mount:
    return find_mount(X_BS, LidarParameters(frame="laser", range_max=range_max), height)


@pytest.mark.parametrize("rpy", [(0.0, 0.03, 1.0), (0.03, 0.0, 1.0), (math.pi - 0.02, 0.02, 1.0)])
def test_a_slight_tilt_costs_margin(rpy: tuple[float, float, float]) -> None:
    placed, level = mount(RigidTransform(RollPitchYaw(rpy), [0.0, 0.0, 0.3])), mount(RigidTransform([0.0, 0.0, 0.3]))
    assert placed.tilt == pytest.approx(math.hypot(math.sin(rpy[0]), rpy[1]), rel=0.01) and level.tilt == 0.0
    more = evaluate_error_budget(scenario(), placed).total - evaluate_error_budget(scenario(), level).total
    assert 0.0005 < more < 0.005


def test_a_tilted_lidar_that_sees_the_floor_is_refused_with_the_figure() -> None:
    pitched = RigidTransform(RollPitchYaw(0.0, 0.03, 0.0), [0.0, 0.0, 0.13])
    with pytest.raises(StarnavError, match=r"1.72 degrees from level, and 0.13 m high: it sees the floor from 4.33 m"):
        mount(pitched, height=0.13)
    assert mount(pitched, range_max=4.0, height=0.13).tilt > 0.0


@pytest.mark.parametrize("frame", ["ahead", "behind", "top_laser"])
def test_hits_of_a_lidar_lie_on_the_obstacles(model: str, frame: str) -> None:
    station = standing(model, f"lidar.frame={frame}")
    simulator = Simulator(station)
    simulator.Initialize()
    context, (mount,) = simulator.get_context(), station.robot_interface.mounts
    scan = station.GetOutputPort("lidar.scan").Eval(context)
    points = align_with_robot(scan, mount).points(
        mount.find_lidar_pose(station.GetOutputPort("localization.scan_pose").Eval(context))
    )
    away = [np.abs(np.hypot(*(points - place[:2]).T) - place[2]) for place in OPEN.cylinders]
    assert len(points) > 50 and np.min(away, axis=0).max() < 1e-3


def test_each_lidar_has_ports_and_noise_of_its_own(model: str) -> None:
    station = standing(model, "lidar.noise=0.01", "lidars=[{frame: ahead}, {frame: ahead, beams: 360}]")
    simulator = Simulator(station)
    simulator.Initialize()
    scans = [station.GetOutputPort(f"{name}.scan").Eval(simulator.get_context()) for name in ("lidar", "lidar_2")]
    assert (scans[0].hits == scans[1].hits).mean() > 0.95
    assert (scans[0].ranges[scans[0].hits] != scans[1].ranges[scans[0].hits]).all()


def test_lidars_that_the_loop_cannot_use_are_refused(model: str) -> None:
    for overrides, said in (
        ((*NARROW, "lidar.frame=ahead"), "views that reach 90 degrees to each side"),
        (("lidar.frame=ahead", "lidar.noise=0.05"), "lidar.noise is 0.05 with a lidar at x 0.2.*: one on the axis"),
        (("lidar.frame=ahead", "robot.radius=0.35", "lidar.range_max=0.5"), "lidar.range_max is 0.5 m"),
        (("lidar.frame=tilted",), "frame tilted is turned by roll 0, pitch 0.1, .* 5.73 degrees .*; allowed: up to 2"),
        (("lidar.frame=laser",), "lidar.frame is laser; allowed: .*, lidar, top_laser$"),
        (("lidars=[{frame: lidar}, {frame: laser}]",), r"lidars\[1\].frame is laser; allowed: .*, lidar, top_laser$"),
    ):
        with pytest.raises(StarnavError, match=said):
            make_diagram(scenario(model, *overrides))
    for overrides, said in ((("lidar.frame=ahead",), "a lidar at x 0.2"), (CORNERS, "2 lidars")):
        with pytest.raises(StarnavError, match=f"method dwa with {said}.*; allowed: one on the axis, unturned"):
            make_diagram(dataclasses.replace(scenario(model, *overrides), method="dwa"))


@pytest.mark.parametrize(("rate", "caution"), [(20.0, 0.5), (8.0, 1.0)])
def test_lidars_of_any_rates_track_what_moves(model: str, rate: float, caution: float) -> None:
    world, speed = "!Crowd {moving_obstacles: [6, 6]}", "obstacles.max_speed=1.5"
    corners = f"lidars=[{{frame: right}}, {{frame: left, rate: {rate}}}]"
    diagram = make_diagram(
        scenario(model, *LIMITED, corners, speed, f"obstacles.caution={caution}", world=world), seed=3
    )
    simulator = Simulator(diagram)
    simulator.AdvanceTo(1.5)
    tracker = diagram.navigation.tracker
    tracks = tracker.GetOutputPort("tracks").Eval(tracker.GetMyContextFromRoot(simulator.get_context()))
    assert tracks.is_confirmed.any() and (len(tracks.occlusion_discs) > 0) == (caution == 1.0)
    (places,), _ = moving_obstacle_states(diagram.navigation.world.moving_obstacles, np.array([tracks.time]))
    assert all(np.hypot(*(places - each).T).min() < 0.15 for each in tracks.position[tracks.is_confirmed])


@pytest.mark.slow
@pytest.mark.parametrize(
    "lidars",
    [
        ("lidar.frame=ahead",),
        ("lidar.frame=behind", "lidar.outliers=0.01", "lidar.dropout=0.02"),
        ("lidar.frame=top_laser", "lidar.rolling=true"),
        (*CORNERS, "lidar.delay=0.08", "lidar.scan_loss=0.1"),
        (*CORNERS, "localization.drift=0.01"),
    ],
)
def test_a_robot_drives_with_lidars_anywhere_and_faults_that_are_declared(model: str, lidars: tuple[str, ...]) -> None:
    trial = run_trial(load_scenario("room", overrides=[model, *lidars]), seed=4)
    assert trial.outcome == "reached" and trial.min_clearance_m > 0.0


@pytest.mark.parametrize("other", ["rate: 33", "rate: 10, range_max: 4", "rate: 15, scan_loss: 0.2", "rolling: true"])
def test_a_robot_drives_with_two_lidars_at_its_corners_whatever_their_rates_and_ranges(model: str, other: str) -> None:
    world = "!Obstacles {cylinders: [[1.5, 0.1, 0.3]], goal: [3.0, 0.0]}"
    lidars = f"lidars=[{{frame: right}}, {{frame: left, {other}}}]"
    trial = run_trial(scenario(model, *LIMITED, lidars, world=world))
    assert trial.outcome == "reached" and trial.min_clearance_m > 0.0


def scene() -> DiagramBuilder:
    """A ball at x = 3 m, and a cart with a mast that carries a plate 1 m ahead, fixed to the world."""
    builder = DiagramBuilder()
    plant, _ = AddMultibodyPlantSceneGraph(builder, 0.0)
    friction = CoulombFriction(0.5, 0.5)
    plant.RegisterCollisionGeometry(plant.world_body(), RigidTransform([3, 0, 0.5]), Sphere(0.5), "ball", friction)
    cart = plant.AddModelInstance("cart")
    base = plant.AddRigidBody("base", cart, SpatialInertia.SolidBoxWithMass(1.0, 1, 1, 1))
    mast = plant.AddRigidBody("mast", cart, SpatialInertia.SolidBoxWithMass(1.0, 1, 1, 1))
    plant.RegisterCollisionGeometry(
        base, RigidTransform([1, 0, 0.5]), Box(0.1, 0.1, 0.1), "plate", ProximityProperties()
    )
    plant.WeldFrames(plant.world_frame(), base.body_frame())
    plant.WeldFrames(base.body_frame(), mast.body_frame())
    plant.Finalize()
    return builder


def ranges(builder: DiagramBuilder, config: LidarConfig) -> np.ndarray:
    lidar = ApplyLidarConfig(config, builder)
    simulator = Simulator(builder.Build())
    simulator.Initialize()
    return lidar.GetOutputPort("ranges").Eval(lidar.GetMyContextFromRoot(simulator.get_context())).copy()


@pytest.mark.parametrize(("sees_parent_model", "distance"), [(False, 2.5), (True, 0.95)])
def test_the_lidar_is_placed_and_connected_as_yaml_says(sees_parent_model: bool, distance: float) -> None:
    text = TEXT + f"sees_parent_model: {str(sees_parent_model).lower()}\n"
    config = yaml_load_typed(schema=LidarConfig, data=yaml_dump_typed(yaml_load_typed(schema=LidarConfig, data=text)))
    # beams at -pi, -pi/2, 0 and pi/2 about z of S, which is turned by 90 degrees
    assert ranges(scene(), config) == pytest.approx([np.inf, distance, np.inf, np.inf])


def test_without_a_base_frame_it_stands_in_the_world() -> None:
    config = LidarConfig(beams=4, noise=0.0)
    config.X_PS.translation = [0.0, 0.0, 0.5]
    builder = scene()
    assert ranges(builder, config) == pytest.approx([np.inf, np.inf, 0.95, np.inf])


@pytest.mark.parametrize(
    "change, words",
    [
        ({"beams": 0}, "lidar.beams is 0; allowed: 3 <= x"),
        ({"range_max": -1.0}, "lidar.range_max is -1"),
        ({"base": "cart::nose"}, "lidar front: X_PS cannot be used: .*nose.*allowed: a frame of the plant"),
        ({"base": "boat::mast"}, "lidar front: X_PS cannot be used: .*boat"),
    ],
)
def test_what_is_wrong_is_said(change: dict, words: str) -> None:
    config = yaml_load_typed(schema=LidarConfig, data=TEXT)
    config.X_PS.base_frame = change.pop("base", config.X_PS.base_frame)
    for name, value in change.items():
        setattr(config, name, value)
    with pytest.raises(StarnavError, match=words):
        ApplyLidarConfig(config, scene())


def test_two_need_two_names_and_a_plant() -> None:
    builder = scene()
    ApplyLidarConfig(LidarConfig(), builder)
    assert builder.HasSubsystemNamed("lidar_sensor_preview_lidar")
    with pytest.raises(StarnavError, match="a lidar named preview_lidar already"):
        ApplyLidarConfig(LidarConfig(), builder)
    with pytest.raises(StarnavError, match="no system named plant"):
        ApplyLidarConfig(LidarConfig(), DiagramBuilder())
