"""Robot models: what one must have, where its meshes are found, and what is refused."""

from pathlib import Path

import numpy as np
import pytest

from drake_starnav import NavigationStation, RobotParameters, Scenario, StarnavError, World, load_scenario
from drake_starnav.scenario.scenario_file import format_scenario, parse_scenario
from drake_starnav.utils.resources import find_model_path
from tests.helpers.robots import robot, wheel

SHELL = "v 0 0 0\nv 0.1 0 0\nv 0 0.1 0\nv 0 0 0.1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n"


def standing(robot: RobotParameters) -> NavigationStation:
    """A station in which the robot stands in the open."""
    return NavigationStation(World("open", (1.0, -2.0, 0.6), (5.0, 0.0)), Scenario("test", None, robot))


def test_unknown_robot_model_names_the_shipped_ones() -> None:
    with pytest.raises(StarnavError, match=r"robot.model is 'tank'; allowed: .*starbot"):
        standing(RobotParameters(model="tank"))


def changed_starbot(folder: Path, old: str, new: str) -> str:
    """Path of a URDF that differs from starbot's in one text, wherever that stands."""
    text = find_model_path("robots", "starbot.urdf").read_text(encoding="utf-8")
    assert old in text
    path = folder / "changed.urdf"
    path.write_text(text.replace(old, new), encoding="utf-8")
    return str(path)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("</robot>", "", "cannot be read"),
        ('<origin xyz="0 0.16 0"/>', '<origin xyz="-0.02 0.16 0"/>', "no two joints .* opposite"),
        ('<axis xyz="0 1 0"/>', '<axis xyz="1 0 0"/>', "no two joints about y or -y"),
        ('xyz="0.15 0 -0.02995"', 'xyz="0.15 0 -0.04"', "reaches .* mm lower than the wheels"),
        ('<mass value="8.2"/>', '<origin xyz="0.2 0 0"/><mass value="8.2"/>', "to 0.15 m, so that it tips over"),
        ('type="continuous"', 'type="prismatic"', "no two joints about y or -y"),
        ('<geometry><sphere radius="0.05"/>', '<geometry><sphere radius="0.01"/>', "lower than the"),
    ],
)
def test_a_robot_model_says_what_it_lacks(tmp_path: Path, old: str, new: str, message: str) -> None:
    path = changed_starbot(tmp_path, old, new)
    with pytest.raises(StarnavError, match=rf"robot model .*changed.urdf.*{message}.*; allowed: "):
        standing(RobotParameters(model=path))


@pytest.mark.parametrize(
    ("shape", "beyond"),
    [
        ('<box size="0.5 0.4 0.1"/>', "70"),
        ('<cylinder radius="0.28" length="0.1"/>', "30"),
        ('<sphere radius="0.27"/>', "20"),
        ('<drake:capsule radius="0.26" length="0.1"/>', "10"),
        ('<drake:ellipsoid a="0.3" b="0.1" c="0.1"/>', "5[01]"),
        ('<mesh filename="shell.obj"/>', "250"),
    ],
)
def test_a_robot_larger_than_its_radius_is_refused(tmp_path: Path, shape: str, beyond: str) -> None:
    (tmp_path / "shell.obj").write_text(SHELL.replace("v 0.1 0 0", "v 0.5 0 0"))
    path = changed_starbot(tmp_path, '<cylinder radius="0.25" length="0.1"/>', shape)
    with pytest.raises(StarnavError, match=f"base_link sticks out of robot.radius 0.25 m by {beyond} mm; allowed"):
        standing(RobotParameters(model=path))


MAST = """
  <link name="mast">
    <inertial><mass value="0.1"/><inertia ixx="1e-3" iyy="1e-3" izz="1e-3" ixy="0" ixz="0" iyz="0"/></inertial>
    <collision><origin xyz="0.3 0 {height}"/><geometry><box size="0.6 0.1 0.1"/></geometry></collision>
  </link>
  <joint name="mast" type="fixed"><parent link="base_link"/><child link="mast"/></joint>
</robot>"""


@pytest.mark.parametrize(
    ("height", "said", "words"),
    [
        (0.5, {}, "link mast sticks out of robot.radius 0.25 m by 35[0-9] mm; allowed: .*robot.overhangs"),
        (0.5, {"footprint": [[0.7, -0.3], [0.7, 0.3], [-0.3, 0.3], [-0.3, -0.3]]}, None),
        (0.5, {"footprint": [[0.5, -0.3], [0.5, 0.3], [-0.3, 0.3], [-0.3, -0.3]]}, "robot.footprint by 100 mm"),
        (0.5, {"overhangs": "mast"}, None),
        (0.05, {"overhangs": "mast"}, "link mast of robot.overhangs reaches down to 0.0[0-9]* m above the floor"),
        (0.5, {"overhangs": "mast boom"}, "no link boom; allowed in robot.overhangs: base_link.*mast"),
    ],
)
def test_a_model_lies_within_its_footprint_but_for_what_swings_above(
    tmp_path: Path, height: float, said: dict, words: str | None
) -> None:
    path = changed_starbot(tmp_path, "</robot>", MAST.format(height=height))
    if words is None:
        standing(RobotParameters(model=path, **said))
        return
    with pytest.raises(StarnavError, match=words):
        standing(RobotParameters(model=path, **said))


@pytest.mark.parametrize("mass_error", [0.0, 0.2])
def test_a_robot_model_finds_the_meshes_beside_it(tmp_path: Path, mass_error: float) -> None:
    (tmp_path / "shell.obj").write_text(SHELL)
    path = changed_starbot(tmp_path, '<box size="0.17 0.05 0.008"/>', '<mesh filename="shell.obj"/>')
    robot = RobotParameters(model=path, mass_error=mass_error)
    inspector = standing(robot).scene_graph.model_inspector()
    assert "Mesh" in {type(inspector.GetShape(g)).__name__ for g in inspector.GetAllGeometryIds()}


def cart(folder: Path, body: str, ahead: float = 0.05) -> Path:
    """A robot with a body of some shape, its axle in the middle, and a lidar on its axis."""
    path = folder / "cart.urdf"
    text = robot(wheel("left", 0.0, 0.12), wheel("right", 0.0, -0.12), body=body)
    path.write_text(text.replace('xyz="0 0 0.06"', f'xyz="{ahead} 0 0.06"'))
    return path


def test_a_shape_is_read_unless_it_is_said_and_saved_with_the_scenario(tmp_path):
    def read(path, *overrides):
        return load_scenario("room", overrides=[f"robot.model={path}", *overrides])

    box = cart(tmp_path, '<box size="0.5 0.3 0.1"/>')
    found = read(box).robot
    assert np.min(found.footprint, axis=0) == pytest.approx((-0.2, -0.15))  # about the axle
    assert np.max(found.footprint, axis=0) == pytest.approx((0.3, 0.15))
    assert found.radius == pytest.approx(np.hypot(0.3, 0.15))
    assert parse_scenario(format_scenario(read(box)), name="room").robot == found
    assert read(box, "robot.radius=0.4").robot.radius == 0.4
    box.with_suffix(".yaml").write_text("robot: {radius: 0.38}\n")
    assert read(box).robot.radius == 0.38
    box.with_suffix(".yaml").unlink()
    round_ = cart(tmp_path, '<cylinder radius="0.25" length="0.08"/>', ahead=0.0)
    assert read(round_).robot.shape.is_disc and read(round_).robot.radius == pytest.approx(0.25, abs=1e-3)
