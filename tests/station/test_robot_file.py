"""Robots as ROS users write them drive, with their own names for joints and frames."""

import dataclasses
import sys
from pathlib import Path

import pytest

from drake_starnav.errors import StarnavError
from drake_starnav.lidar.sensor_model import LidarParameters
from drake_starnav.robot import RobotParameters
from drake_starnav.scenario.schema import Scenario
from drake_starnav.station.navigation_station import NavigationStation
from drake_starnav.station.plant import make_simulator
from drake_starnav.worlds.world import World
from tests.helpers.robots import casters, joint, link, robot, wheel

JOINTS = ("wheel_left_joint", "wheel_right_joint")


EDITED = robot(
    *(link("base_footprint"), joint("base_link", (0.0, 0.0, 0.06), parent="base_footprint")),
    *(wheel("wheel_left", 0.0, 0.13), wheel("wheel_right", 0.0, -0.13), casters(0.15, -0.15)),
).replace('<robot name="small">', '<robot name="plain">')
"""A robot as ROS tutorials have it: `base_footprint`, cylinders as wheels, no motors, nothing said of friction."""


def written(folder: Path, text: str) -> RobotParameters:
    path = folder / "plain.urdf"
    path.write_text(text, encoding="utf-8")
    return RobotParameters(model=str(path), wheel_joints=JOINTS)


def standing(robot: RobotParameters) -> NavigationStation:
    return NavigationStation(World("open", (1.0, -2.0, 0.6), (5.0, 0.0)), Scenario("test", None, robot))


def test_joints_that_are_no_wheels_are_held_still_and_motors_ignored(tmp_path: Path) -> None:
    mast = (
        '<transmission><type>transmission_interface/SimpleTransmission</type><joint name="mast"/><actuator name="m"/>'
        '</transmission><joint name="mast" type="continuous"><parent link="base_link"/><child link="top"/></joint>'
        '<link name="top"/><gazebo><plugin name="drive"/></gazebo><ros2_control name="all" type="system"/></robot>'
    )
    with pytest.warns(UserWarning, match="plain.urdf: joints held still: mast$"):
        station = standing(written(tmp_path, EDITED.replace("</robot>", mast)))
    assert station.plant.num_actuators() == 2 and station.plant.num_velocities() == 6 + 2


def test_what_is_not_shown_is_said_and_what_does_not_collide_is_refused(tmp_path: Path) -> None:
    mesh = '<geometry><mesh filename="package://away/shell.dae"/></geometry>'
    visual, collision = (
        EDITED.replace("</link>", f"<{kind}>{mesh}</{kind}></link>", 1) for kind in ("visual", "collision")
    )
    with pytest.warns(UserWarning, match="not shown: package://away/shell.dae"):
        standing(written(tmp_path, visual))
    with pytest.raises(StarnavError, match=r"\.urdf: link base_link: mesh 'package://away/shell.dae': no such file"):
        standing(written(tmp_path, collision))


MACROS = """<robot name="plain" xmlns:xacro="http://ros.org/wiki/xacro">
<xacro:property name="width" value="0.26"/><xacro:include filename="$(find plain_description)/wheel.xacro"/>
<xacro:include filename="$(find elsewhere)/sensor.xacro"/>"""


ARGUMENTS = """<robot name="plain" xmlns:xacro="http://ros.org/wiki/xacro">
<xacro:arg name="half" default="0.1"/><xacro:arg name="prefix" default=""/><xacro:arg name="tall" default="false"/>"""


HEIGHT = "0 0 ${0.3 if '$(arg tall)' == 'true' else 0.12}"


@pytest.mark.filterwarnings("ignore")
def test_arguments_of_xacro_are_those_of_the_scenario(tmp_path: Path) -> None:
    pytest.importorskip("xacro")
    text = EDITED.replace('<robot name="plain">', ARGUMENTS).replace('"0.0 0.13 0.0"', '"0 $(arg half) 0"')
    text = text.replace("lidar", "$(arg prefix)lidar").replace("0.0 0.0 0.12", HEIGHT)
    robot = written(tmp_path, text)
    arguments = {"half": 0.13, "prefix": "r1_", "tall": True}
    lidar = LidarParameters(frame="r1_lidar")
    scenario = Scenario("test", None, dataclasses.replace(robot, xacro_args=arguments), lidar)
    station = NavigationStation(World("open", (1.0, -2.0, 0.6), (5.0, 0.0)), scenario)
    assert station.robot_interface.heights == pytest.approx((0.36,), abs=1e-6)
    with pytest.raises(StarnavError, match=r"xacro_args.prefx .* did you mean prefix\? allowed: half, prefix, tall$"):
        standing(dataclasses.replace(robot, xacro_args={"prefx": "r1_"}))
    with pytest.raises(StarnavError, match=r"robot.xacro_args.half is \[\]; allowed: a text, a number"):
        dataclasses.replace(robot, xacro_args={"half": []})
    with pytest.raises(StarnavError, match=r"robot.xacro_args is .* which has no macros of xacro; allowed: none"):
        standing(dataclasses.replace(written(tmp_path, EDITED), xacro_args={"half": 0.13}))


@pytest.mark.filterwarnings("ignore")
def test_a_package_that_xacro_misses_is_named_in_one_sentence(tmp_path: Path) -> None:
    pytest.importorskip("xacro")
    text = EDITED.replace('<robot name="plain">', MACROS).replace("</robot>", "<xacro:sensor/></robot>")
    (tmp_path / "package.xml").write_text('<package format="2"><name>plain_description</name></package>')
    (tmp_path / "wheel.xacro").write_text('<robot xmlns:xacro="http://ros.org/wiki/xacro"/>')
    with pytest.raises(StarnavError, match=r"package elsewhere, which it names, is not found; allowed: ") as raised:
        standing(written(tmp_path, text))
    assert "\n" not in str(raised.value)
    whole = f'{MACROS.partition("<xacro:property")[0]}<xacro:include filename="$(find nowhere)/robot.xacro"/></robot>'
    with pytest.raises(StarnavError, match="package nowhere, which it names, is not found"):
        standing(dataclasses.replace(written(tmp_path, whole), radius=0.0))


@pytest.mark.parametrize(
    "limit",
    [
        '<limit lower="0" upper="0" effort="0" velocity="0"/>',
        '<limit lower="-3.14" upper="3.14" effort="10" velocity="10"/>',
        '<limit lower="-1e16" upper="1e16" effort="10" velocity="10"/>',
        '<limit effort="10" velocity="10"/>',
    ],
)
@pytest.mark.parametrize("kind", ["continuous", "revolute"])
def test_wheels_turn_without_end_whatever_their_limits(tmp_path: Path, kind: str, limit: str) -> None:
    text = EDITED.replace('"continuous"', f'"{kind}"').replace('<axis xyz="0 0 1"/>', f'<axis xyz="0 0 1"/>{limit}')
    station = standing(written(tmp_path, text))
    simulator = make_simulator(station)
    context = simulator.get_mutable_context()
    station.GetInputPort("drive.twist_command").FixValue(context, [0.4, 0.8])
    simulator.AdvanceTo(3.0)
    assert station.GetOutputPort("localization.state").Eval(context)[3:] == pytest.approx((0.4, 0.8), abs=0.01)


@pytest.mark.parametrize("name", ["chassis", "r1/base_link", "r1_base_link", "base_footprint", "base_link"])
@pytest.mark.parametrize("prefixed", [False, True])
def test_the_base_may_be_called_anything(tmp_path: Path, name: str, prefixed: bool) -> None:
    begin, end = EDITED.index('<link name="base_footprint">'), EDITED.index('<link name="wheel_left">')
    text = (EDITED[:begin] + EDITED[end:]).replace('"base_link"', f'"{name}"')
    joints = JOINTS
    if prefixed:
        for part in ("wheel_", "lidar", "caster_"):
            text = text.replace(f'"{part}', f'"r1/{part}')
        joints = ("r1/wheel_left_joint", "r1/wheel_right_joint")
    robot = dataclasses.replace(written(tmp_path, text), wheel_joints=joints)
    frame = "r1/lidar" if prefixed else "lidar"
    for lidar in (frame, name):
        scenario = Scenario("test", None, robot, LidarParameters(frame=lidar))
        station = NavigationStation(World("open", (1.0, -2.0, 0.6), (5.0, 0.0)), scenario)
        height = 0.06 + (0.12 if lidar == frame else 0.0)
        assert station.robot_interface.heights == pytest.approx((height,), abs=1e-6)


def test_macros_without_the_extra_are_refused(tmp_path: Path, monkeypatch) -> None:
    monkeypatch.setitem(sys.modules, "xacro", None)
    with pytest.raises(StarnavError, match="has macros of xacro; allowed: pip install .*xacro.*, or a file"):
        standing(written(tmp_path, EDITED.replace('<robot name="plain">', MACROS)))
