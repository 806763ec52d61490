"""The body of a robot in a plant: the footprint of a shipped robot, and what of a model sticks out of it."""

import dataclasses
import xml.etree.ElementTree as ElementTree
from collections.abc import Mapping
from typing import Any, NoReturn

import numpy as np
from pydrake.geometry import Cylinder, Shape
from pydrake.math import RigidTransform, RollPitchYaw
from pydrake.multibody.plant import CoulombFriction
from pydrake.multibody.tree import BodyIndex

from drake_starnav.errors import StarnavError, shown
from drake_starnav.geometry.footprint import ROUNDING, Footprint, measure_protrusion
from drake_starnav.robot import RobotParameters
from drake_starnav.scenario.directives import SHAPE, read_model_sections
from drake_starnav.station.robot_geometry import TOLERANCE, RobotModel
from drake_starnav.station.world_geometry import make_upright_prism

FRICTION = CoulombFriction(0.3, 0.3)
KEPT_VISUALS = ("lidar_puck", "heading")
"""Visuals of the shipped robots that stay when they get another body."""
HOLDS_ALL = (
    "a footprint that holds all of it, folded as its joints' default positions say, or its name in robot.overhangs"
)


def add_body(robot: RobotModel, shape: Footprint, heights: tuple[float, float]) -> None:
    """Give the base of a shipped robot, in a plant not yet finalized, its footprint as its body.

    Args:
        robot: without the shapes of its base.
        shape: what it covers.
        heights: of the body's bottom and top in base_link, m.
    """
    for name, solid, X_BG in _make_solids(shape, "hull", *heights):
        robot.plant.RegisterCollisionGeometry(robot.base, X_BG, solid, name, FRICTION)


def add_looks(robot: RobotModel, shape: Footprint, heights: tuple[float, float], root: ElementTree.Element) -> None:
    """The same for its looks, with a lighter deck on top, in the colours of its model."""
    top, share = heights[1], 0.86
    deck = dataclasses.replace(shape, parts=tuple(share * part for part in shape.parts), radius=share * shape.radius)
    layers = (("hull", shape, heights, "shell"), ("deck", deck, (top, top + 0.004), "deck"))
    for layer, each, (low, high), material in layers:
        color = root.find(f"material[@name='{material}']/color")
        rgba = np.array([float(value) for value in color.get("rgba", "").split()])  # type: ignore[union-attr]
        for name, solid, X_BG in _make_solids(each, layer, low, high):
            robot.plant.RegisterVisualGeometry(robot.base, X_BG, solid, f"{name}_visual", rgba)


def _make_solids(shape: Footprint, name: str, low: float, high: float) -> list[tuple[str, Shape, RigidTransform]]:
    X_BG = RigidTransform([0.0, 0.0, 0.5 * (low + high)])
    if shape.is_disc:
        return [(name, Cylinder(shape.radius, high - low), X_BG)]
    return [
        (f"{name}_{k}" if k else name, make_upright_prism(part, high - low, f"{name}_{k}"), X_BG)
        for k, part in enumerate(shape.parts)
    ]


def find_protrusion(
    robot: RobotModel, poses: Mapping[BodyIndex, RigidTransform], parameters: RobotParameters
) -> tuple[float, str]:
    """By how much a robot's links at their poses in base_link stick out of its footprint, m, and which of them.

    Links of `robot.overhangs` do not count.
    """
    parts_outside = [
        (measure_protrusion(parameters.shape, each.points[:2].T, each.grown), each.link.name())
        for each in robot.find_extents(poses)
        if each.floor is not True and each.link.name() not in parameters.overhangs.split()
    ]
    return max(parts_outside, default=(0.0, "base_link"))


def find_overhang_faults(robot: RobotModel, parameters: RobotParameters, floor: float) -> list[str]:
    """What is wrong with `robot.overhangs`; `floor`: its height in base_link, m."""
    names, faults, top = [link.name() for link in robot.links], [], robot.top(parameters.overhangs.split())
    lowest: dict[str, float] = {}
    for each in robot.find_extents(robot.poses()):
        lowest[each.link.name()] = min(lowest.get(each.link.name(), np.inf), each.low - floor)
    for name in parameters.overhangs.split():
        if name not in names:
            faults.append(f"it has no link {name}; allowed in robot.overhangs: {', '.join(names)}")
        elif lowest.get(name, np.inf) < top - TOLERANCE:
            faults.append(
                f"link {name} of robot.overhangs reaches down to {lowest[name]:.3f} m above the floor; allowed: links "
                f"above the rest of the robot, from {top:.3g} m on"
            )
    return faults


def remove_body_and_redraw(root: ElementTree.Element, robot: RobotParameters) -> tuple[tuple[float, float], bool]:
    """Take its body from the base of a shipped robot, and draw all else into the robot's footprint.

    Returns from where to where the body reached, m, and whether the footprint is another than the model's.
    """
    own = RobotParameters(**read_own_body(robot.model))
    has_changed = (robot.footprint, robot.radius) != (own.footprint, own.radius)
    heights = _remove_body(root, keeps_looks=not has_changed)
    growth = min(robot.shape.cover_radius / own.shape.cover_radius, robot.shape.radius / own.shape.radius)
    _move_parts_outwards(root, robot, max(growth, 1.0))
    return heights, has_changed


def read_own_body(model: str) -> dict[str, Any]:
    """`radius` or `footprint` of a shipped robot, as its file says."""
    robot_section = read_model_sections(model, {}).get("robot", {})
    return {key: robot_section[key] for key in SHAPE if key in robot_section}


def _remove_body(root: ElementTree.Element, *, keeps_looks: bool) -> tuple[float, float]:
    """Take its body from the base of a shipped robot, but for casters; returns from where to where it reached, m."""
    base = root.find("link[@name='base_link']")
    assert base is not None
    reach = []
    for element in [each for each in base if each.tag in ("collision", "visual")]:
        if element.find("geometry/sphere") is not None or element.get("name") in KEPT_VISUALS:
            continue
        if element.tag == "collision":
            box, cylinder = (element.find(f"geometry/{kind}") for kind in ("box", "cylinder"))
            height = float(box.get("size", "").split()[2] if box is not None else cylinder.get("length", "0"))  # type: ignore[union-attr]
            reach.append(read_pose(element).translation()[2] + 0.5 * height * np.array((-1.0, 1.0)))
        if element.tag == "collision" or not keeps_looks:
            base.remove(element)
    low, high = np.array(reach).T
    return float(low.min()), float(high.max())


def _move_parts_outwards(root: ElementTree.Element, robot: RobotParameters, growth: float) -> None:
    """Move wheels, casters and marks of a shipped robot outwards by its growth, as far as its footprint holds them.

    A robot that brakes would pitch on casters near its axis, and a lidar of long range see the floor. Its inertia about
    x and y grows alike, as of a body that is higher, too; that about its axis stays, so that the wheels turn it as
    before. Its centre of mass is drawn in with what it stands on. The wheels stay opposite each other, and are as wide
    as they look, as they roll on the planes of spheres; marks for which there is no room are left out.
    """
    base, inertial = root.find("link[@name='base_link']"), root.find("link[@name='base_link']/inertial")
    assert base is not None and inertial is not None
    inertia, drawn_in = inertial.find("inertia"), 1.0
    assert inertia is not None
    about = {axis: float(inertia.get(axis, "0")) for axis in ("ixx", "iyy")}
    for axis, previous_place in about.items():
        inertia.set(axis, repr(previous_place + (growth**2 - 1.0) * max(about.values())))
    wheels = list(root.iterfind("joint"))
    for element in [each for each in base if each.tag in ("collision", "visual")]:
        share = _find_largest_share(robot.shape, growth, [(element, [element])])
        if element.find("geometry/sphere") is None and element.get("name") not in KEPT_VISUALS:
            continue
        if share is None and element.get("name") not in KEPT_VISUALS:
            _refuse_size(robot, "base_link")
        elif share is None:
            base.remove(element)
        else:
            _scale_place(element, share)
            drawn_in = min(drawn_in, share) if element.tag == "collision" else drawn_in
    _scale_place(inertial, drawn_in)
    visual_links = [(joint, [*root.iterfind(f"link[@name='{find_link(joint, 'child')}']/visual")]) for joint in wheels]
    share = _find_largest_share(robot.shape, growth, visual_links)
    for joint, parts in visual_links:
        width = max(float(_find_floor_print(part)[0][:, 1].max()) for part in parts)
        if share is None or share * abs(read_pose(joint).translation()[1]) <= width:  # it would be in its opposite
            _refuse_size(robot, find_link(joint, "child") or "")
    assert share is not None
    for joint in wheels:
        _scale_place(joint, share)


def _refuse_size(robot: RobotParameters, link: str) -> NoReturn:
    size_text = (
        f"robot.footprint is {shown(robot.footprint)}" if robot.footprint else f"robot.radius is {robot.radius:g} m"
    )
    raise StarnavError(
        f"{size_text}, which has no room for link {link} of {robot.model}; allowed: a body that holds wheels and "
        "casters, drawn in towards its origin"
    )


def _find_largest_share(
    shape: Footprint, limit: float, places: list[tuple[ElementTree.Element, list[ElementTree.Element]]]
) -> float | None:
    """The largest share of their distances from the axis to which elements can be moved so that all parts lie in a
    footprint."""
    prints = [
        (read_pose(element).translation()[:2], *_find_floor_print(part)) for element, parts in places for part in parts
    ]
    for share in np.linspace(limit, 0.0, 101):
        if all(
            measure_protrusion(shape, points + share * place, margin) <= ROUNDING for place, points, margin in prints
        ):
            return float(share)
    return None


def _find_floor_print(element: ElementTree.Element) -> tuple[np.ndarray, float]:
    """What a shape of a shipped robot covers about its place: all that is so near, m, to the hull of points (n, 2)."""
    shape = element.find("geometry")[0]  # type: ignore[index]
    radius, length = (float(shape.get(key, "0")) for key in ("radius", "length"))
    if shape.tag == "sphere" or (shape.tag == "cylinder" and read_pose(element).rotation().IsNearlyIdentity()):
        return np.zeros((1, 2)), radius
    size = shape.get("size", f"{2.0 * radius} {length}").split()  # of a wheel's cylinder, about y
    x, y = 0.5 * float(size[0]), 0.5 * float(size[1])
    return np.array(((x, y), (-x, y), (-x, -y), (x, -y))), 0.0


def _scale_place(element: ElementTree.Element, share: float) -> None:
    X = read_pose(element)
    if share != 1.0:
        set_pose(element, RigidTransform(X.rotation(), X.translation() * (share, share, 1.0)))


def find_link(joint: ElementTree.Element, end: str) -> str | None:
    element = joint.find(end)
    return None if element is None else element.get("link")


def read_pose(element: ElementTree.Element) -> RigidTransform:
    """The pose of a frame in its link, or of an element with an `<origin>`."""
    origin = element if element.tag == "frame" else element.find("origin")
    xyz, rpy = (("0 0 0" if origin is None else origin.get(key, "0 0 0")).split() for key in ("xyz", "rpy"))
    return RigidTransform(RollPitchYaw([float(angle) for angle in rpy]), [float(value) for value in xyz])


def set_pose(element: ElementTree.Element, X: RigidTransform) -> None:
    origin = element if element.tag == "frame" else element.find("origin")
    if origin is None:
        origin = ElementTree.SubElement(element, "origin")
    for key, values in (("xyz", X.translation()), ("rpy", RollPitchYaw(X.rotation()).vector())):
        origin.set(key, " ".join(repr(float(value)) for value in values))
