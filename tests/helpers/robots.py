"""Small robots of the structures that published URDF files have."""

import math
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from drake_starnav.robot import RobotParameters
from drake_starnav.scenario.schema import Scenario
from drake_starnav.station.navigation_station import NavigationStation
from drake_starnav.station.plant import make_simulator
from drake_starnav.worlds.world import World

START = (0.0, 0.0, 0.0)
NONE = np.zeros((0, 3))
CASTER = '<sphere radius="0.02"/>'
WHEEL = '<cylinder radius="0.06" length="0.04"/>'


def link(name: str, shape: str = "", *, mass: float = 0.1, origin: str = "") -> str:
    """A link with a collision shape, or none."""
    collision = f"<collision>{origin}<geometry>{shape}</geometry></collision>" if shape else ""
    size = 0.01 * mass
    return (
        f'<link name="{name}"><inertial><mass value="{mass}"/><inertia ixx="{size}" iyy="{size}" izz="{size}" ixy="0" '
        f'ixz="0" iyz="0"/></inertial>{collision}</link>'
    )


def joint(
    child: str,
    xyz: Sequence[float] = (0.0, 0.0, 0.0),
    *,
    parent: str = "base_link",
    kind: str = "fixed",
    rpy: str = "0 0 0",
    axis: str = "",
) -> str:
    """A joint `<child>_joint`."""
    turns = f'<axis xyz="{axis}"/>' if axis else ""
    limit = '<limit lower="-0.5" upper="0.5" effort="1" velocity="1"/>' if kind in ("prismatic", "revolute") else ""
    return (
        f'<joint name="{child}_joint" type="{kind}"><parent link="{parent}"/><child link="{child}"/>'
        f'<origin xyz="{" ".join(map(repr, xyz))}" rpy="{rpy}"/>{turns}{limit}</joint>'
    )


def wheel(name: str, x: float, y: float, *, shape: str = WHEEL, axis: str = "0 0 1", parent: str = "base_link") -> str:
    """A wheel at height 0 of its parent, turned as ROS users do: its axis is z, which points to the left."""
    at = joint(name, (x, y, 0.0), kind="continuous", rpy=f"{-0.5 * math.pi} 0 0", axis=axis, parent=parent)
    return link(name, shape, mass=0.3) + at


def robot(*parts: str, lidar: Sequence[float] = (0.0, 0.0), body: str = '<box size="0.4 0.2 0.08"/>') -> str:
    """A robot whose body is 2 to 10 cm above base_link, with a lidar."""
    base = link("base_link", body, mass=6.0, origin='<origin xyz="0 0 0.06"/>')
    return "".join(('<robot name="small">', base, link("lidar"), joint("lidar", (*lidar, 0.12)), *parts, "</robot>"))


def casters(*places: float) -> str:
    """Spheres on the floor that wheels of radius 0.06 stand on."""
    names = [f"caster_{k}" for k in range(len(places))]
    return "".join(link(n, CASTER) + joint(n, (x, 0.0, -0.04)) for n, x in zip(names, places, strict=True))


def standing(folder: Path, text: str, *, cylinders: np.ndarray = NONE, **given: object) -> NavigationStation:
    """A station in which a robot of that text stands among posts."""
    path = folder / "small.urdf"
    path.write_text(text, encoding="utf-8")
    parameters = RobotParameters(model=str(path), **{"radius": 0.5, **given})  # type: ignore[arg-type]
    return NavigationStation(World("open", START, (5.0, 0.0), cylinders), Scenario("test", None, parameters))


def driven(station: NavigationStation, v: float, omega: float, time: float = 2.0) -> list[float]:
    """(x, y, yaw, v, omega) after it was told to drive so for a time, s."""
    simulator = make_simulator(station)
    context = simulator.get_mutable_context()
    station.GetInputPort("drive.twist_command").FixValue(context, [v, omega])
    simulator.AdvanceTo(time)
    return station.GetOutputPort("localization.state").Eval(context).tolist()
