"""Model files of robots, adapted before the plant reads them: names, wheels, the shipped robots' size."""

import math
import os
import xml.etree.ElementTree as ElementTree
from pathlib import Path

from drake_starnav.errors import StarnavError, shown
from drake_starnav.robot import RobotParameters
from drake_starnav.utils.resources import model_path
from drake_starnav.worlds.formats.model_files import Models, parsed_xml

WHEELS = ("left_wheel", "right_wheel")
"""Names that the joints and actuators of the wheels have in a plant, whatever they are called in the model's file."""
HULL = "hull"
"""Geometries of the shipped robots whose name begins so get the radius of `robot.radius`; wheels stay inside it."""


def robot_urdf(robot: RobotParameters) -> tuple[str, str]:
    """The robot's model file and its text as the plant reads it.

    The hull of a shipped robot gets the radius `robot.radius`; the base's mass and inertia grow by `robot.mass_error`.
    Wheels get the names `WHEELS` and motors; a `base_footprint` above `base_link` is left out.
    """
    path = model_path("robots", f"{robot.model}.urdf")
    shipped = os.path.isfile(path)
    if not shipped:
        path = Path(robot.model)
        if path.suffix != ".urdf" or not os.path.isfile(path):
            names = ", ".join(sorted(p.stem for p in model_path("robots").glob("*.urdf")))
            raise StarnavError(f"robot.model is {shown(robot.model)}; allowed: {names}, or the path of a .urdf file")
    try:
        root = parsed_xml(path.read_bytes())
    except (OSError, ValueError, ElementTree.ParseError) as error:
        raise StarnavError(f"robot model {path} cannot be read: {error}; allowed: a URDF file with one robot") from None
    _leave_out_footprint(root)
    _name_wheels(root, robot.wheel_joints)
    _round_wheels(root)
    if shipped:
        for element in (*root.iter("collision"), *root.iter("visual")):
            cylinder = element.find("geometry/cylinder")
            if element.get("name", "").startswith(HULL) and cylinder is not None:
                cylinder.set("radius", repr(robot.radius))
        _pull_in(root, robot.radius)
    inertial = root.find("link[@name='base_link']/inertial")
    if robot.mass_error != 0.0 and inertial is not None:
        for element in (*inertial.iter("mass"), *inertial.iter("inertia")):
            for key, value in element.attrib.items():
                element.set(key, repr(float(value) * (1.0 + robot.mass_error)))
    Models().urdf(root, path.resolve().parent)
    return str(path), ElementTree.tostring(root, encoding="unicode")


def _leave_out_footprint(root: ElementTree.Element) -> None:
    """Let `base_link` be the root if it is fixed, upright, on an empty `base_footprint`."""
    link, joint = root.find("link[@name='base_footprint']"), root.find("joint[child]/child[@link='base_link']/..")
    parents = [parent for parent in root.iterfind("joint/parent") if parent.get("link") == "base_footprint"]
    if (
        link is None
        or len(link)
        or joint is None
        or joint.get("type") != "fixed"
        or joint.find("parent") not in parents
    ):
        return
    origin = joint.find("origin")
    turned = "0 0 0" if origin is None else origin.get("rpy", "0 0 0")
    if len(parents) > 1 or any(float(angle) != 0.0 for angle in turned.split()):
        return
    root.remove(link)
    root.remove(joint)


def _name_wheels(root: ElementTree.Element, joints: tuple[str, str]) -> None:
    """Give the joints of the wheels and their actuators the names `WHEELS`, and a motor to one without."""
    for given, name in zip(joints, WHEELS, strict=True):
        joint = root.find(f"joint[@name='{given}']")
        if joint is None:
            continue
        joint.set("name", name)
        drives = [
            each
            for each in root.iter("transmission")  # Drake ignores those of other types
            if each.find(f"joint[@name='{given}']") is not None
            and each.findtext("type", "").strip().endswith("SimpleTransmission")
        ]
        if not drives:
            drives = [ElementTree.SubElement(root, "transmission", name=name)]
            ElementTree.SubElement(drives[0], "type").text = "transmission_interface/SimpleTransmission"
            ElementTree.SubElement(drives[0], "joint", name=given)
            ElementTree.SubElement(drives[0], "actuator")
        for element in (*drives[0].iter("joint"), *drives[0].iter("actuator")):
            element.set("name", name)


def _round_wheels(root: ElementTree.Element) -> None:
    """Let wheels that collide as cylinders collide as spheres of their radius.

    The edge of a cylinder on the floor makes the robot 0.03 m/s too slow.
    """
    for name in WHEELS:
        child = root.find(f"joint[@name='{name}']/child")
        link = None if child is None else root.find(f"link[@name='{child.get('link')}']")
        for geometry in () if link is None else link.findall("collision/geometry"):
            cylinder = geometry.find("cylinder")
            if cylinder is not None:
                geometry.remove(cylinder)
                ElementTree.SubElement(geometry, "sphere", radius=cylinder.get("radius", "0"))


def _pull_in(root: ElementTree.Element, radius: float) -> None:
    """Move wheels and casters towards the axis where they would reach out of a hull of this radius."""
    joints = {joint.find("child").get("link"): joint for joint in root.findall("joint")}  # type: ignore[union-attr]
    for link in root.iter("link"):
        for element in (*link.iter("collision"), *link.iter("visual")):
            sphere = element.find("geometry/sphere")
            moved = joints.get(link.get("name"), element)
            origin = moved.find("origin")
            if sphere is None or origin is None:
                continue
            x, y, z = (float(value) for value in origin.get("xyz", "0 0 0").split())
            far = radius - float(sphere.get("radius", "0"))
            if far <= 0.0:
                raise StarnavError(
                    f"robot.radius is {radius:g}; allowed: more than the model's wheels have, {radius - far:g} m"
                )
            share = min(1.0, far / max(math.hypot(x, y), 1e-9))
            origin.set("xyz", f"{x * share!r} {y * share!r} {z!r}")
