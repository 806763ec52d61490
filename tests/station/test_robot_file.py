"""Robots as ROS users write them drive, with their own names for joints and frames."""

from pathlib import Path

import numpy as np
import pytest

from drake_starnav.errors import StarnavError
from drake_starnav.robot import RobotParameters
from drake_starnav.scenario import Scenario
from drake_starnav.station.navigation_station import NavigationStation
from drake_starnav.station.plant import make_simulator
from drake_starnav.station.robot_file import robot_urdf
from drake_starnav.utils.resources import model_path
from drake_starnav.worlds.world import World

JOINTS = ("wheel_left_joint", "wheel_right_joint")


def inertial(mass: float, inertia: float) -> str:
    return (
        f'<inertial><mass value="{mass}"/>'
        f'<inertia ixx="{inertia}" iyy="{inertia}" izz="{inertia}" ixy="0" ixz="0" iyz="0"/></inertial>'
    )


def ros_urdf() -> str:
    """A robot as ROS tutorials have it: `base_footprint`, cylinders as wheels, no motors, nothing said of friction."""
    parts = [
        '<robot name="plain"><link name="base_footprint"/>',
        '<joint name="base_joint" type="fixed"><parent link="base_footprint"/><child link="base_link"/>',
        '<origin xyz="0 0 0.06" rpy="0 0 0"/></joint>',
        f'<link name="base_link">{inertial(6.0, 0.1)}<collision><origin xyz="0 0 0.06"/>',
        '<geometry><box size="0.36 0.2 0.08"/></geometry></collision></link>',
        f'<link name="base_scan">{inertial(0.1, 0.0001)}</link><joint name="scan_joint" type="fixed">',
        '<parent link="base_link"/><child link="base_scan"/><origin xyz="0 0 0.12" rpy="0 0 0"/></joint>',
    ]
    for side, y in (("left", 0.13), ("right", -0.13)):
        parts.append(
            f'<link name="wheel_{side}_link">{inertial(0.4, 0.001)}<collision>'
            '<geometry><cylinder radius="0.06" length="0.03"/></geometry></collision></link>'
            f'<joint name="wheel_{side}_joint" type="continuous"><parent link="base_link"/>'
            f'<child link="wheel_{side}_link"/><origin xyz="0 {y} 0" rpy="-1.57 0 0"/><axis xyz="0 0 1"/></joint>'
        )
    for end, x in (("front", 0.15), ("rear", -0.15)):
        parts.append(
            f'<link name="{end}_caster">{inertial(0.05, 0.0001)}<collision><geometry><sphere radius="0.02"/>'
            f'</geometry></collision></link><joint name="{end}_caster_joint" type="fixed"><parent link="base_link"/>'
            f'<child link="{end}_caster"/><origin xyz="{x} 0 -0.04"/></joint>'
        )
    return "\n".join((*parts, "</robot>"))


EDITED = ros_urdf().replace("base_scan", "lidar")
"""The one edit that it takes: the lidar's link is called so."""


def written(folder: Path, text: str) -> RobotParameters:
    path = folder / "plain.urdf"
    path.write_text(text, encoding="utf-8")
    return RobotParameters(model=str(path), wheel_joints=JOINTS)


def standing(robot: RobotParameters) -> NavigationStation:
    return NavigationStation(World("open", (1.0, -2.0, 0.6), (5.0, 0.0)), Scenario("test", None, robot))


def test_a_plain_urdf_drives_as_commanded_after_one_edit(tmp_path: Path) -> None:
    station = standing(written(tmp_path, EDITED))
    simulator = make_simulator(station)
    context = simulator.get_mutable_context()
    twist = np.array([0.4, 0.8])
    station.GetInputPort("drive.twist_command").FixValue(context, twist)
    simulator.AdvanceTo(3.0)
    state = station.GetOutputPort("localization.state").Eval(context)
    assert state[3:] == pytest.approx(twist, abs=0.01)


def test_the_lidar_is_where_its_link_is(tmp_path: Path) -> None:
    station = standing(written(tmp_path, EDITED))
    simulator = make_simulator(station)
    simulator.Initialize()
    X_WS = station.GetOutputPort("lidar.X_WS").Eval(simulator.get_context())
    assert X_WS.translation() == pytest.approx((1.0, -2.0, 0.18), abs=1e-6)


def test_what_a_plain_urdf_needs_is_said(tmp_path: Path) -> None:
    robot = written(tmp_path, ros_urdf())
    with pytest.raises(StarnavError, match="it has no frame lidar; allowed: a frame or a link lidar"):
        standing(robot)
    with pytest.raises(StarnavError, match="no joints left_wheel, right_wheel; .*robot.wheel_joints.* wheel_left_jo"):
        standing(RobotParameters(model=robot.model))


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ('<link name="base_footprint"/>', f'<link name="base_footprint">{inertial(1.0, 0.1)}</link>'),
        ('xyz="0 0 0.06" rpy="0 0 0"', 'xyz="0 0 0.06" rpy="0 0.1 0"'),
    ],
)
def test_a_footprint_that_is_more_than_a_name_is_refused(tmp_path: Path, old: str, new: str) -> None:
    assert old in EDITED
    with pytest.raises(StarnavError, match="base_link hangs by joint base_joint on base_footprint"):
        standing(written(tmp_path, EDITED.replace(old, new, 1)))


def test_actuators_get_the_names_of_their_wheels(tmp_path: Path) -> None:
    text = model_path("robots", "starbot.urdf").read_text(encoding="utf-8")
    path = tmp_path / "motors.urdf"
    path.write_text(text.replace('<actuator name="right_wheel"/>', '<actuator name="motor"/>'), encoding="utf-8")
    _, adapted = robot_urdf(RobotParameters(model=str(path)))
    assert adapted is not None and '<actuator name="right_wheel"' in adapted and "motor" not in adapted


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ('<axis xyz="0 0 1"/>', '<axis xyz="0 0 -1"/>', "joint wheel_left_joint turns about 0 -1 "),
        ('<origin xyz="0 0.13 0"', '<origin xyz="0 0.1 0"', "joints wheel_left_joint, wheel_right_joint lie at x 0, 0"),
        ("</robot>", '<transmission><type>transmission_interface/SimpleTransmission</type><joint name="mast"/>'
         '<actuator name="mast"/></transmission><joint name="mast" type="continuous"><parent link="base_link"/>'
         '<child link="top"/></joint><link name="top"/></robot>',
         "actuators mast, wheel_left_joint, wheel_right_joint; allowed: wheel_left_joint, wheel_right_joint"),
    ],
)  # fmt: skip
def test_messages_name_the_wheels_as_the_file_does(tmp_path: Path, old: str, new: str, said: str) -> None:
    assert old in EDITED
    with pytest.raises(StarnavError, match=said) as caught:
        standing(written(tmp_path, EDITED.replace(old, new, 1)))
    assert "left_wheel" not in str(caught.value)


def test_a_transmission_that_drake_does_not_know_leaves_the_wheel_a_motor(tmp_path: Path) -> None:
    other = (
        '<transmission><type>FourBarLinkage</type><joint name="wheel_left_joint"/><actuator name="m"/></transmission>'
    )
    station = standing(written(tmp_path, EDITED.replace("</robot>", f"{other}</robot>")))
    assert station.plant.num_actuators() == 2
