"""Robot models: what one must have, where its meshes are found, and what is refused."""

from pathlib import Path

import pytest

from drake_starnav.errors import StarnavError
from drake_starnav.lidar import LidarParameters
from drake_starnav.models import model_path
from drake_starnav.robot import RobotParameters
from drake_starnav.station import NavigationStation
from drake_starnav.worlds.world import World


def standing(robot: RobotParameters) -> NavigationStation:
    """A station in which the robot stands in the open."""
    return NavigationStation(World("open", (1.0, -2.0, 0.6), (5.0, 0.0)), robot, LidarParameters())


@pytest.mark.parametrize("radius", [0.05, 0.04])
def test_a_hull_without_room_for_its_wheels_is_refused(radius: float) -> None:
    with pytest.raises(
        StarnavError, match=rf"robot.radius is {radius}; allowed: more than the model's wheels have, 0.05 m"
    ):
        standing(RobotParameters(radius=radius))


def test_unknown_robot_model_names_the_shipped_ones() -> None:
    with pytest.raises(StarnavError, match=r"robot.model is 'tank'; allowed: .*starbot"):
        standing(RobotParameters(model="tank"))


def changed_starbot(folder: Path, old: str, new: str) -> str:
    """Path of a URDF that differs from starbot's in one text, wherever that stands."""
    text = model_path("robots", "starbot.urdf").read_text(encoding="utf-8")
    assert old in text
    path = folder / "changed.urdf"
    path.write_text(text.replace(old, new), encoding="utf-8")
    return str(path)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ('"base_link"', '"chassis"', "has no link base_link"),
        ('<frame name="lidar"', '<frame name="laser"', "has no frame lidar"),
        ('joint name="left_wheel"', 'joint name="port_wheel"', "has no joint left_wheel"),
        ('<actuator name="right_wheel"/>', '<actuator name="motor"/>', "has no actuator right_wheel"),
        ('<sphere radius="0.05"/>', '<cylinder radius="0.05" length="0.03"/>', "link left_wheel collides as Cylinder"),
        ("</robot>", "", "cannot be read"),
        ('link="base_link" xyz="0 0 0.08"', 'link="base_link" xyz="0.15 0 0.08"', "frame lidar lies at x 0.15, y 0 m"),
        ('xyz="0 0 0.08" rpy="0 0 0"', 'xyz="0 0 0.08" rpy="0 0 1.57"', "frame lidar .* yaw 1.57 rad"),
        ('xyz="0 0 0.08" rpy="0 0 0"', 'xyz="0 0 0.08" rpy="0 0.1 0"', "frame lidar .* pitch 0.1, yaw 0 rad"),
    ],
)
def test_a_robot_model_says_what_it_lacks(tmp_path: Path, old: str, new: str, message: str) -> None:
    path = changed_starbot(tmp_path, old, new)
    with pytest.raises(StarnavError, match=rf"robot model .*changed.urdf.*{message}.*; allowed: "):
        standing(RobotParameters(model=path))


@pytest.mark.parametrize("mass_error", [0.0, 0.2])
def test_a_robot_model_finds_the_meshes_beside_it(tmp_path: Path, mass_error: float) -> None:
    (tmp_path / "shell.obj").write_text(
        "v 0 0 0\nv 0.1 0 0\nv 0 0.1 0\nv 0 0 0.1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n"
    )
    path = changed_starbot(tmp_path, '<box size="0.17 0.05 0.008"/>', '<mesh filename="shell.obj"/>')
    robot = RobotParameters(model=path, mass_error=mass_error)
    inspector = standing(robot).scene_graph.model_inspector()
    assert "Mesh" in {type(inspector.GetShape(g)).__name__ for g in inspector.GetAllGeometryIds()}
