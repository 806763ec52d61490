"""Lidars of a robot's model: where they are, what is asked of their frames, and that the robot drives with them."""

import math
import shutil
from pathlib import Path

import numpy as np
import pytest
from pydrake.math import RigidTransform, RollPitchYaw
from pydrake.systems.analysis import Simulator

from drake_starnav.errors import StarnavError
from drake_starnav.lidar.mounts import ON_AXIS, Mount, unturned
from drake_starnav.loading import load_scenario, parse_scenario
from drake_starnav.navigation import make_diagram
from drake_starnav.scenario import Scenario
from drake_starnav.simulation import run_trial
from drake_starnav.station.lidar_mounts import mount_of
from drake_starnav.station.navigation_station import NavigationStation
from drake_starnav.utils.resources import model_path
from drake_starnav.worlds.world import World

FRAMES = {
    "ahead": ("0.2 0 0.08", "0 0 0"),
    "behind": ("-0.2 0 0.08", "0 0 2.5"),
    "top_laser": ("0.1 0.05 0.08", "3.141592653589793 0 0.5"),
    "tilted": ("0 0 0.08", "0 0.1 0"),
    "right": ("0.16 -0.16 0.08", "0 0 -0.7853981633974483"),
    "left": ("-0.16 0.16 0.08", "0 0 2.356194490192345"),
}
LIMITED = ("lidar.beams=271", "lidar.angle_min=-2.356194490192345", "lidar.angle_max=2.356194490192345")
CORNERS = (*LIMITED, "lidars=[{frame: right}, {frame: left}]")
OPEN = World("open", (1.0, -2.0, 0.6), (5.0, 0.0), cylinders=[(2.0, -2.0, 0.3), (0.2, -1.6, 0.1), (1.0, 0.0, 0.5)])


@pytest.fixture(scope="module")
def model(tmp_path_factory: pytest.TempPathFactory) -> str:
    """Override for starbot with more frames."""
    path = tmp_path_factory.mktemp("robot") / "mounted.urdf"
    return with_frames("starbot", path, FRAMES)


def with_frames(name: str, path: Path, frames: dict[str, tuple[str, str]]) -> str:
    """Override for a shipped robot with more frames, written to a path."""
    text = model_path("robots", f"{name}.urdf").read_text(encoding="utf-8")
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
    assert mount_of(turned, "laser") == pytest.approx(Mount(0.1, 0.2, 0.5, True))
    assert mount_of(RigidTransform([5e-4, 0.0, 0.3]), "laser") == ON_AXIS
    assert mount_of(RigidTransform(RollPitchYaw(0.0, 0.0, 5e-4), [0.1, 0.0, 0.3]), "laser") == Mount(0.1, 0, 0, False)


def test_a_tilted_lidar_is_refused(model: str) -> None:
    with pytest.raises(StarnavError, match="frame tilted is turned by roll 0, pitch 0.1, .* allowed: a level"):
        standing(model, "lidar.frame=tilted")


def test_a_missing_frame_is_said_with_those_that_may_be_meant(model: str) -> None:
    with pytest.raises(StarnavError, match="lidar.frame is laser; allowed: .*, lidar, top_laser$"):
        standing(model, "lidar.frame=laser")


def test_without_a_frame_that_may_be_meant_all_are_named(tmp_path: Path) -> None:
    text = model_path("robots", "starbot.urdf").read_text(encoding="utf-8")
    path = tmp_path / "bare.urdf"
    path.write_text(text.replace('<frame name="lidar"', '<frame name="top"'), encoding="utf-8")
    with pytest.raises(StarnavError, match="allowed: .*, base_link, left_wheel, right_wheel, top$"):
        standing(f"robot.model={path}")


@pytest.mark.parametrize("frame", ["ahead", "behind", "top_laser"])
def test_hits_of_a_lidar_lie_on_the_obstacles(model: str, frame: str) -> None:
    station = standing(model, f"lidar.frame={frame}")
    simulator = Simulator(station)
    simulator.Initialize()
    context, (mount,) = simulator.get_context(), station.robot_interface.mounts
    scan = station.GetOutputPort("lidar.scan").Eval(context)
    points = unturned(scan, mount).points(mount.unturned(station.GetOutputPort("localization.scan_pose").Eval(context)))
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
        ((*LIMITED, "lidar.frame=right"), "at the robot's own body for .* around 135 degrees .*; allowed: "),
        (("lidar.frame=ahead", "obstacles.max_speed=0.5"), "obstacles.max_speed is 0.5 with a lidar at x 0.2, y 0 m"),
        (
            ("lidar.frame=ahead", "lidar.noise=0.05"),
            "lidar.noise is 0.05 with a lidar at x 0.2.*: one on the axis",
        ),
        (("lidar.frame=ahead", "controller.kind=dwa"), "controller.kind is dwa with a lidar at x 0.2"),
        ((*CORNERS, "controller.kind=star_paper"), "controller.kind is star_paper with 2 lidars; allowed: one on"),
        (("lidar.frame=ahead", "robot.radius=0.35", "lidar.range_max=0.5"), "lidar.range_max is 0.5 m"),
    ):
        with pytest.raises(StarnavError, match=said):
            make_diagram(scenario(model, *overrides))


@pytest.mark.slow
@pytest.mark.parametrize("seed", [1, 2])
@pytest.mark.parametrize(
    "lidars", [("lidar.frame=ahead",), ("lidar.frame=behind",), ("lidar.frame=top_laser",), CORNERS]
)
def test_a_robot_drives_with_lidars_anywhere(model: str, lidars: tuple[str, ...], seed: int) -> None:
    trial = run_trial(load_scenario("forest", overrides=[model, *lidars]), seed=seed)
    assert trial.outcome == "reached" and trial.min_clearance_m > 0.0


@pytest.mark.slow
@pytest.mark.parametrize(
    "faults",
    [
        ("lidar.outliers=0.01", "lidar.dropout=0.02"),
        ("lidar.rolling=true",),
        ("lidar.delay=0.08", "lidar.scan_loss=0.1"),
        ("localization.drift=0.01",),
    ],
)
def test_declared_faults_are_allowed_for_with_lidars_anywhere(model: str, faults: tuple[str, ...]) -> None:
    trial = run_trial(load_scenario("room", overrides=[model, *CORNERS, *faults]), seed=4)
    assert trial.outcome == "reached" and trial.min_clearance_m > 0.0


@pytest.mark.slow
@pytest.mark.parametrize("seed", [6, 7])
def test_a_polygon_drives_with_two_lidars_at_its_corners(tmp_path: Path, seed: int) -> None:
    corners = {"right": ("0.39 -0.24 0.07", FRAMES["right"][1]), "left": ("-0.39 0.24 0.07", FRAMES["left"][1])}
    carrier = with_frames("carrier", tmp_path / "carrier.urdf", corners)
    shutil.copy(model_path("robots", "carrier.yaml"), tmp_path)
    trial = run_trial(load_scenario("forest", overrides=[carrier, *CORNERS]), seed=seed)
    assert trial.outcome == "reached" and trial.min_clearance_m > 0.0


def test_a_robot_drives_with_two_lidars_at_its_corners(model: str) -> None:
    world = "!Obstacles {cylinders: [[1.5, 0.1, 0.3]], goal: [3.0, 0.0]}"
    trial = run_trial(scenario(model, *CORNERS, world=world))
    assert trial.outcome == "reached" and trial.min_clearance_m > 0.0
