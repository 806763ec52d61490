"""The shape of a robot of the user's own is that of its model, unless something is said of it."""

from pathlib import Path

import numpy as np
import pytest

from drake_starnav import load_scenario
from drake_starnav.errors import StarnavError
from drake_starnav.scenario import parse_scenario
from drake_starnav.scenario.scenario_file import scenario_text
from drake_starnav.station.own_shape import with_own_shape

WHEEL = """
  <joint name="{side}" type="continuous">
    <parent link="base_link"/><child link="{side}_link"/><origin xyz="0 {y} 0"/><axis xyz="0 1 0"/>
  </joint>
  <link name="{side}_link">
    <inertial><mass value="0.4"/><inertia ixx="6e-4" iyy="1e-3" izz="6e-4" ixy="0" ixz="0" iyz="0"/></inertial>
    <collision><origin rpy="1.5708 0 0"/><geometry><cylinder radius="0.07" length="0.03"/></geometry></collision>
  </link>"""


def cart(folder: Path, body: str) -> Path:
    """A robot with a body of some shape, its axle in the middle, and a lidar on its axis."""
    path = folder / "cart.urdf"
    wheels = WHEEL.format(side="left", y=0.12) + WHEEL.format(side="right", y=-0.12)
    path.write_text(
        f"""<robot name="cart" xmlns:drake="http://drake.mit.edu"><link name="base_link">
    <inertial><mass value="8"/><inertia ixx="0.05" iyy="0.08" izz="0.11" ixy="0" ixz="0" iyz="0"/></inertial>
    <collision><origin xyz="0.05 0 0.03"/><geometry>{body}</geometry></collision></link>
    <frame name="lidar" link="base_link" xyz="0 0 0.08" rpy="0 0 0"/>{wheels}</robot>"""
    )
    return path


def test_a_box_is_a_polygon_about_the_axle(tmp_path):
    path = cart(tmp_path, '<box size="0.5 0.3 0.1"/>')
    robot = load_scenario("room", overrides=[f"robot.model={path}"]).robot
    corners = np.array(robot.footprint)
    assert corners.min(axis=0) == pytest.approx((-0.2, -0.15))
    assert corners.max(axis=0) == pytest.approx((0.3, 0.15))
    assert robot.radius == pytest.approx(np.hypot(0.3, 0.15))


def test_a_round_robot_is_a_disc(tmp_path):
    path = cart(tmp_path, '<cylinder radius="0.25" length="0.1"/>')
    text = path.read_text().replace('xyz="0.05 0 0.03"', 'xyz="0 0 0.03"')
    path.write_text(text)
    robot = load_scenario("room", overrides=[f"robot.model={path}"]).robot
    assert robot.shape.is_disc and robot.radius == pytest.approx(0.25, abs=1e-3)


def test_what_is_said_of_the_shape_counts_and_a_saved_scenario_holds_what_was_read(tmp_path):
    path = cart(tmp_path, '<box size="0.5 0.3 0.1"/>')
    assert load_scenario("room", overrides=[f"robot.model={path}", "robot.radius=0.4"]).robot.radius == 0.4
    read = load_scenario("room", overrides=[f"robot.model={path}"])
    assert parse_scenario(scenario_text(read), name="room").robot == read.robot
    path.with_suffix(".yaml").write_text("robot: {radius: 0.38}\n")
    assert load_scenario("room", overrides=[f"robot.model={path}"]).robot.radius == 0.38


def test_a_shape_that_was_not_read_is_named(tmp_path):
    path = cart(tmp_path, '<box size="0.5 0.3 0.1"/>')
    text = f"{{world: !Forest {{}}, robot: {{model: {path}}}}}"
    unread = parse_scenario(text, name="w")
    with pytest.raises(StarnavError, match="was not read"):
        _ = unread.robot.shape
    assert with_own_shape(unread).robot.footprint
    with pytest.raises(StarnavError, match="allowed: 0, or at least"):
        parse_scenario("{world: !Forest {}, robot: {radius: 0.001}}", name="w")
