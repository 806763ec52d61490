"""What a robot may hit of a world and its lidars do not see."""

import warnings
from pathlib import Path

import pytest
import trimesh

from drake_starnav import NavigationStation, Scenario, World, parse_scenario, run_trial
from drake_starnav.station.model_world import make_world_with_footprints
from tests.helpers.robots import casters, joint, link, robot, wheel


def cart(folder: Path, *, lidar: float = 0.2, mast: float = 0.0) -> Path:
    """A small robot with a lidar at a height, m, and with a post on it of a height, if any."""
    wheels = wheel("left", 0.0, 0.14) + wheel("right", 0.0, -0.14)
    post = link("mast", f'<cylinder radius="0.02" length="{mast}"/>', origin=f'<origin xyz="0 0 {0.5 * mast - 0.06}"/>')
    parts = wheels, casters(-0.1, 0.1), post + joint("mast") if mast else ""
    path = folder / "cart.urdf"
    path.write_text(robot(*parts, body='<box size="0.3 0.2 0.08"/>').replace(" 0.12", f" {lidar - 0.06}"))
    return path


def driven(model: Path, world: str) -> Scenario:
    return parse_scenario(f"world: {world}\nrobot: {{model: {model}, radius: 0}}", name="heights")


def sdf(folder: Path, shape: str, z: float) -> str:
    """A world with one shape, and in SDF a model of the name m."""
    path = folder / "m.sdf"
    path.write_text(
        f'<sdf version="1.7"><model name="m"><static>1</static><link name="l"><pose>2 0 {z} 0 0 0</pose>'
        f'<collision name="c"><geometry>{shape}</geometry></collision></link></model></sdf>'
    )
    return f"!Model {{directives: {path}, start: [0, 0, 0], goal: [5, 0]}}"


def said(folder: Path, world: str, **heights: float) -> list[str]:
    """Warnings of a station of the world."""
    scenario = driven(cart(folder, **heights), world)
    with warnings.catch_warnings(record=True) as raised:
        warnings.simplefilter("always")
        made = make_world_with_footprints(scenario.world, 0, scenario.robot.radius)
        NavigationStation(made, scenario)
    return [str(each.message) for each in raised]


@pytest.mark.parametrize(
    ("shape", "z", "lidar", "mast", "unseen"),
    [
        ("<box><size>1 1 0.3</size></box>", 0.15, 0.2, 0.0, 0),
        ("<box><size>1 1 0.3</size></box>", 0.15, 0.4, 0.0, 1000),  # a crate below the lidar
        ("<cylinder><radius>0.3</radius><length>0.1</length></cylinder>", 0.05, 0.2, 0.0, 600),
        ("<box><size>1 1 0.04</size></box>", 0.75, 0.2, 1.2, 1000),  # a table top above the lidar, at the mast
        ("<box><size>1 1 0.04</size></box>", 0.75, 0.2, 0.0, 0),  # it drives below it
        ("<box><size>1 1 0.04</size></box>", 0.75, 0.75, 1.2, 0),
        ("<box><size>1 1 0.04</size></box>", 1.5, 0.75, 1.2, 0),
        ("<cone><radius>0.4</radius><length>1</length></cone>", 0.5, 0.2, 0.0, 75),
        ("<box><size>1 1 0.02</size></box>", 0.21, 0.2, 0.4, 1000),  # a shelf whose underside the lidar grazes
        ("<box><size>1 1 0.02</size></box>", 0.19, 0.2, 0.4, 1000),
        ("<box><size>1 1 0.02</size></box>", 0.2, 0.2, 0.4, 0),
        ("<mesh><uri>table.obj</uri></mesh>", 0.0, 0.2, 0.4, 460),  # its legs are seen, its top is not
        ("<mesh><uri>table.obj</uri></mesh>", 0.0, 0.29, 0.4, 0),
        ("<mesh><uri>table.obj</uri></mesh>", 0.0, 0.2, 0.0, 0),  # it drives below it
        ("<sphere><radius>0.05</radius></sphere>", 0.05, 0.2, 0.0, 100),
        ("<sphere><radius>0.3</radius></sphere>", 0.3, 0.2, 0.0, 0),
    ],
)
def test_what_the_lidar_does_not_see_is_named(tmp_path: Path, shape, z, lidar, mast, unseen) -> None:
    corners = [(x, y) for x in (-0.45, 0.45) for y in (-0.45, 0.45)]
    boxes = [((-0.5, -0.5, 0.28), (0.5, 0.5, 0.32)), *(((x, y, 0.0), (x + 0.04, y + 0.04, 0.28)) for x, y in corners)]
    parts = [trimesh.creation.box(bounds=bounds) for bounds in boxes]
    trimesh.util.concatenate(parts).export(tmp_path / "table.obj")
    texts = said(tmp_path, sdf(tmp_path, shape, z), lidar=lidar, mast=mast)
    assert len(texts) == bool(unseen)
    if unseen:
        (text,) = texts
        assert text.startswith("world m: the robot, ") and f"at a height of {lidar:g} m does not see: m::c (by " in text
        assert float(text.split("(by ")[1].split(" mm")[0]) == pytest.approx(unseen, rel=0.15)


@pytest.mark.parametrize("weld", [True, False])
def test_what_joints_hold_is_named_and_a_robot_is_not(tmp_path: Path, weld: bool) -> None:
    """Of a crate with a drawer both, welded to the world or not."""
    world = sdf(tmp_path, "<box><size>0.4 0.4 0.3</size></box>", 0.15).replace(
        "start", f"weld: {str(weld).lower()}, start"
    )
    file = tmp_path / "m.sdf"
    heavy = "<inertial><mass>1</mass></inertial>"
    drawer = '<collision name="d"><geometry><box><size>0.3 0.3 0.1</size></box></geometry></collision>'
    joint = '<joint name="j" type="prismatic"><parent>l</parent><child>b</child><axis><xyz>1 0 0</xyz></axis></joint>'
    more = f'<link name="b"><pose>2.3 0 0.15 0 0 0</pose>{heavy}{drawer}</link>{joint}</model>'
    text = file.read_text().replace("<static>1</static>", "").replace("</link>", f"{heavy}</link>")
    file.write_text(text.replace("</model>", more))
    (text,) = said(tmp_path, world, lidar=0.4)
    assert "m::c (by 400 mm)" in text and "m::d (by 300 mm)" in text and "cart" not in text
    assert not said(tmp_path, world, lidar=0.15)


def test_spheres_that_a_lidar_looks_over_are_named(tmp_path: Path) -> None:
    scenario = driven(cart(tmp_path, lidar=0.6), "!Obstacles {}")
    world = World("balls", (0, 0, 0), (5, 0), spheres=[(2.0, 0.0, 0.2), (3.0, 0.0, 0.5)])
    with pytest.warns(UserWarning, match=r"at a height of 0\.6 m does not see: .*sphere_0 \(by "):
        NavigationStation(world, scenario)


@pytest.mark.parametrize("lidar", [0.55, 2.5])
def test_what_is_generated_is_as_high_as_the_lidar_needs(tmp_path: Path, lidar: float) -> None:
    world = "!Obstacles {bounds: [-1.5, -2, 5, 2], cylinders: [[1.5, 0.1, 0.3]], start: [0, 0, 0], goal: [3, 0]}"
    outcome = run_trial(driven(cart(tmp_path, lidar=lidar), world), seed=1)
    assert outcome.outcome == "reached" and outcome.min_clearance_m > 0.0
