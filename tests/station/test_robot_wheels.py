"""Robots drive as they are told whatever the structure of their files, and turn about the middle of their axles."""

import math
from pathlib import Path

import numpy as np
import pytest

from drake_starnav import RobotParameters, StarnavError
from tests.helpers.robots import WHEEL, casters, driven, joint, link, robot, standing, wheel


def tyre(radius: float, width: float) -> str:
    """An OBJ file of a prism of 48 sides about z."""
    angle = 2.0 * math.pi / 48 * np.arange(48)
    rim = [(radius * math.cos(a), radius * math.sin(a)) for a in angle]
    lines = [f"v {x} {y} {z}" for z in (-0.5 * width, 0.5 * width) for x, y in rim]
    lines += [f"f {k + 1} {(k + 1) % 48 + 1} {(k + 1) % 48 + 49} {k + 49}" for k in range(48)]
    return "\n".join(
        [*lines, f"f {' '.join(str(k) for k in range(48, 0, -1))}", f"f {' '.join(map(str, range(49, 97)))}"]
    )


def hung(kind: str, axis: str) -> str:
    """Wheels that hang on links which their joints let move."""
    parts = []
    for side, y in (("left", 0.13), ("right", -0.13)):
        parts += [link(f"{side}_drop"), joint(f"{side}_drop", (0.0, y, 0.01), kind=kind, axis=axis)]
        down = joint(side, (0.0, 0.0, -0.01), parent=f"{side}_drop", kind="continuous", rpy="-1.57 0 0", axis="0 0 1")
        parts += [link(side, WHEEL, mass=0.3), down]
    return "".join(parts)


def swivel(name: str, x: float, y: float) -> str:
    """A caster with a wheel of its own, as low as the others."""
    small = '<cylinder radius="0.02" length="0.01"/>'
    turning = joint(name, (x, y, 0.0), kind="continuous", axis="0 0 1")
    at = joint(f"{name}_wheel", (-0.02, 0.0, -0.04), parent=name, kind="continuous", rpy="-1.5708 0 0", axis="0 0 1")
    return link(name) + turning + link(f"{name}_wheel", small) + at


def pair(shape: str = WHEEL, left: str = "0 0 1", right: str = "0 0 1") -> str:
    """Two wheels of a shape, and their axes."""
    return wheel("left", 0.0, 0.13, shape=shape, axis=left) + wheel("right", 0.0, -0.13, shape=shape, axis=right)


def axles(*places: float, width: float = 0.13) -> str:
    return "".join(
        wheel(f"{side}_{k}", x, y) for k, x in enumerate(places) for side, y in (("l", width), ("r", -width))
    )


PAIR = pair()
FOOT = link("base_footprint", '<box size="0.3 0.2 0.001"/>')
ARMS = "".join(
    link(f"{side}_arm", '<box size="0.1 0.02 0.02"/>')
    + joint(f"{side}_arm", (0.05, y, 0.08), kind="revolute", axis="0 1 0")
    for side, y in (("left", 0.08), ("right", -0.08))
)
ROBOTS = {
    "plain": robot(PAIR, casters(0.15, -0.15)),
    "one caster": robot(PAIR, casters(-0.15)),
    "no caster": robot(PAIR),
    "a box for a caster, too low": robot(
        PAIR, link("skid", '<box size="0.03 0.01 0.02"/>'), joint("skid", (-0.12, 0.0, -0.054))
    ),
    "axle behind": robot(axles(-0.12), casters(0.14), lidar=(-0.12, 0.0)),
    "axle to the left": robot(wheel("a", 0.05, 0.16), wheel("b", 0.05, -0.1), casters(0.2), lidar=(0.05, 0.03)),
    "on a footprint with a shape": robot(
        FOOT, joint("base_link", (0.0, 0.0, 0.0605), parent="base_footprint"), PAIR, casters(0.15)
    ),
    "in a world": robot(
        '<link name="world"/>',
        link("root"),
        joint("root", (1.0, 0.0, 0.0), parent="world"),
        joint("base_link", (0.1, 0.0, 0.1), parent="root", rpy="0 0 0.5"),
        PAIR,
    ),
    "wheel drops": robot(hung("prismatic", "0 0 1"), casters(0.15)),
    "suspensions": robot(hung("revolute", "0 1 0"), casters(0.15)),
    "axes to the right": robot(pair(left="0 0 -1", right="0 0 -1"), casters(0.15)),
    "one axis to the right": robot(pair(right="0 0 -1"), casters(0.15)),
    "wheels on swivels": robot(PAIR, swivel("fl", 0.15, 0.08), swivel("fr", 0.15, -0.08)),
    "arms": robot(PAIR, ARMS, casters(-0.15)),
    "four wheels": robot(axles(0.13, -0.13)),
    "four wheels, not about base_link": robot(axles(0.16, -0.1), lidar=(0.03, 0.0)),
    "six wheels": robot(axles(0.15, 0.0, -0.15)),
    "tyres": robot(pair('<mesh filename="tyre.obj"/>')),
    "spheres": robot(pair('<sphere radius="0.06"/>'), casters(0.15)),
    "hubs with tyres": robot(
        *(
            wheel(s, 0.0, y, shape="") + link(f"{s}_tyre", WHEEL) + joint(f"{s}_tyre", (0.0, 0.0, 0.01), parent=s)
            for s, y in (("l", 0.13), ("r", -0.13))
        ),
        casters(0.15),
    ),
}  # fmt: skip


@pytest.mark.filterwarnings("ignore:robot model .* joints held still")
@pytest.mark.parametrize("kind", ROBOTS)
@pytest.mark.parametrize(("v", "omega"), [(-0.4, 0.8), (0.0, 1.5)])
def test_it_drives_as_it_is_told(tmp_path: Path, kind: str, v: float, omega: float) -> None:
    (tmp_path / "tyre.obj").write_text(tyre(0.06, 0.04), encoding="utf-8")
    x, y, yaw, speed, rate = driven(standing(tmp_path, ROBOTS[kind]), v, omega, 1.5)
    assert (speed, rate) == pytest.approx((v, omega), abs=0.01)
    if v == 0.0:  # it turns about its centre, which is where it was put
        assert math.hypot(x, y) < 0.003 and yaw > 0.95 * 1.5 * omega


def test_what_wheels_roll_on_is_no_part_of_the_robot(tmp_path: Path) -> None:
    """The spheres reach to y = 0.19."""
    narrow = '<box size="0.1 0.1 0.08"/>'
    cylinders, spheres = (robot(pair(shape), body=narrow) for shape in (WHEEL, '<sphere radius="0.06"/>'))
    small = RobotParameters(radius=0.1)
    by, _ = standing(tmp_path, cylinders).robot_interface.sticking_out(small)
    assert 0.1 + by == pytest.approx(math.hypot(0.06, 0.15), abs=1e-4)
    by, _ = standing(tmp_path, spheres).robot_interface.sticking_out(small)
    assert 0.1 + by == pytest.approx(math.hypot(0.06, 0.13), abs=1e-3)


@pytest.mark.parametrize(
    ("given", "said"),
    [
        (("l_0 l_1", "r_0 r_1"), None),
        (("l_0", "r_1"), "lie at x 0.13, -0.13, y 0.13, -0.13 m"),
        (("l_0 l_9", "r_0 r_1"), "no joint l_9_joint about y or -y; allowed: robot.wheel_joints: .* l_0_joint"),
        (("l_0", ""), "no joint on one side about y"),
        (("r_0", "l_0"), "y -0.13, 0.13 m of base_link; allowed: .* left ones at"),
    ],
)
@pytest.mark.filterwarnings("ignore:robot model .* joints held still")
def test_wheels_may_be_named(tmp_path: Path, given: tuple[str, str], said: str | None) -> None:
    names = tuple(" ".join(f"{name}_joint" for name in side.split()) for side in given)
    if said is None:
        assert standing(tmp_path, ROBOTS["four wheels"], wheel_joints=names).plant.num_actuators() == 6
    else:
        with pytest.raises(StarnavError, match=said):
            standing(tmp_path, ROBOTS["four wheels"], wheel_joints=names)


@pytest.mark.parametrize(("gap", "struck"), [(0.01, False), (-0.005, True)])
def test_a_post_beside_a_wheel_is_struck_by_its_width(tmp_path: Path, gap: float, struck: bool) -> None:
    """Only the wheel, from y = 0.11 to 0.15, can touch it."""
    narrow = robot(PAIR, casters(0.03, -0.03), body='<box size="0.1 0.1 0.08"/>')
    station = standing(tmp_path, narrow, cylinders=np.array([[0.0, 0.15 + gap + 0.1, 0.1]]))
    query = station.geometry_query.Eval(station.CreateDefaultContext())
    pairs = [{pair.id_A, pair.id_B} for pair in query.ComputePointPairPenetration()]
    assert any(not pair & set(station.floor) for pair in pairs) == struck
    assert any(pair & set(station.floor) for pair in pairs)  # it stands on something
