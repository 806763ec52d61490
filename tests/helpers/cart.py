"""A cart of any size."""

import math
from pathlib import Path

from drake_starnav import parse_scenario
from drake_starnav.scenario.schema import Scenario


def round_robot(radius: float) -> str:
    """A cart of any size, as a URDF: a round body with two wheels, of the density of a mouse-sized one."""
    mass, wheel = 1.9e3 * radius**3, 0.3 * radius

    def link(name: str, share: float, size: float, height: float, lift: float) -> str:
        inertia = f'ixx="{0.25 * share * mass * size**2}" iyy="{0.25 * share * mass * size**2}"'
        return (
            f'<link name="{name}"><inertial><mass value="{share * mass}"/><inertia {inertia} '
            f'izz="{0.5 * share * mass * size**2}" ixy="0" ixz="0" iyz="0"/></inertial><collision><origin xyz="0 0 '
            f'{lift}"/><geometry><cylinder radius="{size}" length="{height}"/></geometry></collision></link>'
        )

    joints = "".join(
        f'<joint name="{side}" type="continuous"><parent link="base_link"/><child link="{side}_wheel"/><origin '
        f'xyz="0 {y} 0" rpy="-1.5708 0 0"/><axis xyz="0 0 1"/></joint>'
        + link(f"{side}_wheel", 0.05, wheel, 0.15 * radius, 0.0)
        for side, y in (("left", 0.8 * radius), ("right", -0.8 * radius))
    )
    laser = (
        f'<joint name="mount" type="fixed"><parent link="base_link"/><child link="laser"/>'
        f'<origin xyz="0 0 {0.6 * radius}"/>'
    )
    return (
        f'<robot name="cart">{link("base_link", 0.9, 0.99 * radius, 0.5 * radius, 0.3 * radius)}{joints}{laser}</joint>'
        '<link name="laser"/></robot>'
    )


def cart_scenario(radius: float, folder: Path) -> Scenario:
    """A scenario with a cart of a radius, m, whose speeds are those of a pendulum of its size."""
    model, scale = folder / f"cart_{radius:g}.urdf", radius / 0.04
    model.write_text(round_robot(radius), encoding="utf-8")
    speed = 0.3 * math.sqrt(scale)
    robot = (
        f"model: {model}, radius: {radius}, max_speed: {speed}, max_acceleration: 1.0, "
        f"max_yaw_rate: {4.0 / math.sqrt(scale)}, max_yaw_acceleration: {10.0 / scale}"
    )
    lidar = f"frame: laser, noise: 0, range_min: 0.005, range_max: {max(1.5, 8.0 * radius + 2.0 * speed**2)}"
    return parse_scenario(f"world: !Obstacles {{}}\nrobot: {{{robot}}}\nlidar: {{{lidar}}}", name="cart")
