"""Model files of robots, adapted before the plant reads them: root, joints held still, the shipped robots' size."""

import math
import os
import warnings
import xml.etree.ElementTree as ElementTree
from collections.abc import Collection
from pathlib import Path
from typing import NamedTuple

from pydrake.math import RigidTransform

from drake_starnav.errors import StarnavError, shown
from drake_starnav.models.model_files import Models, expand_model_file, parse_xml
from drake_starnav.robot import MODEL_FILES, RobotParameters
from drake_starnav.station.robot_body import find_link, read_pose, remove_body_and_redraw, set_pose
from drake_starnav.utils.files import explain_read_errors, read_bytes
from drake_starnav.utils.resources import find_model_path

READ_PARTS = ("link", "joint", "material", "frame")
"""Parts of a robot that are read; sensors, transmissions, `ros2_control`, `gazebo` and the like are left out."""


class ModelText(NamedTuple):
    """A robot's model file, and its content with `base_link` as the root of all links, without motors.

    `body`: of a shipped robot, heights in base_link between which it gets its footprint as its body, m; else None.
    `changed`: whether that is another one than its model's.
    """

    path: str
    root: ElementTree.Element
    body: tuple[float, float] | None = None
    changed: bool = False


def make_robot_urdf(robot: RobotParameters) -> ModelText:
    """The robot's model. A shipped robot is without the shapes of its base, its wheels are inside its footprint.

    What it calls its base is called `base_link`: the link whose name ends so, prefixed or not, or else the root of all.
    The base's mass and inertia grow by `robot.mass_error`.

    Raises:
        StarnavError: there is no such model, it cannot be read, or the footprint has no room for the wheels.
    """
    path = find_model_path("robots", f"{robot.model}.urdf")
    is_shipped = os.path.isfile(path)
    if not is_shipped:
        path = Path(robot.model)
        if path.suffix not in MODEL_FILES:
            names = ", ".join(sorted(p.stem for p in find_model_path("robots").glob("*.urdf")))
            raise StarnavError(
                f"robot.model is {shown(robot.model)}; allowed: {names}, or the path of a .urdf or .xacro file"
            )
    root = _read_model(path, robot)
    _name_base(root)
    _reroot_at_base(root)
    body, has_changed = remove_body_and_redraw(root, robot) if is_shipped else (None, False)
    _correct_masses(root, robot.mass_error)
    models = Models()
    models.make_urdf_readable(root, path.resolve())
    if models.unseen:
        warnings.warn(f"robot model {path}: not shown: {', '.join(sorted(models.unseen))}", stacklevel=2)
    return ModelText(str(path), root, body, has_changed)


def _read_model(path: Path, robot: RobotParameters) -> ElementTree.Element:
    """The parts of a model file that are read, its macros expanded."""
    place, allowed_text = f"robot model {path}", "a URDF file with one robot"
    data = read_bytes(path, place, allowed_text)
    with explain_read_errors(place, allowed_text):
        root = parse_xml(expand_model_file(data, path, robot.xacro_args, place))
    for part in list(root):
        if part.tag not in READ_PARTS and not part.tag.startswith("{"):
            root.remove(part)
    return root


def _correct_masses(root: ElementTree.Element, mass_error: float) -> None:
    """Let the base's mass and inertia grow by an error, and leave out the inertias of links without a mass."""
    inertial = root.find("link[@name='base_link']/inertial")
    if mass_error != 0.0 and inertial is not None:
        for element in (*inertial.iter("mass"), *inertial.iter("inertia")):
            for key, value in element.attrib.items():
                element.set(key, repr(float(value) * (1.0 + mass_error)))
    for link in root.iter("link"):
        mass = link.find("inertial/mass")
        if mass is not None and float(mass.get("value", "0")) == 0.0:
            link.remove(link.find("inertial"))  # type: ignore[arg-type]


def fix_joints(root: ElementTree.Element, wheels: Collection[str]) -> list[str]:
    """Fix all joints but the wheels', which turn without end and friction; returns the names of those that moved."""
    held_joints = []
    for joint in root.iterfind("joint"):
        name = joint.get("name", "")
        dropped_tags: tuple[str, ...] = ("mimic", "dynamics", "safety_controller", "calibration")
        if name in wheels:
            joint.set("type", "continuous")
            for limit in joint.iterfind("limit"):  # of exporters that write 0, and of `revolute`
                for end in ("lower", "upper"):
                    limit.attrib.pop(end, None)
        elif joint.get("type") != "fixed":
            held_joints.append(name)
            joint.set("type", "fixed")
            dropped_tags = (*dropped_tags, "axis", "limit")
        for part in [each for each in joint if each.tag in dropped_tags]:
            joint.remove(part)
    return held_joints


def move_origin(root: ElementTree.Element, x: float, y: float) -> None:
    """Move the origin of `base_link` to a point (x, y) of it, m."""
    base = root.find("link[@name='base_link']")
    moved_parts = [] if base is None else [part for part in base if part.tag in ("inertial", "visual", "collision")]
    moved_parts += [frame for frame in root.iterfind("frame") if frame.get("link") == "base_link"]
    moved_parts += [joint for joint in root.iterfind("joint[parent]") if find_link(joint, "parent") == "base_link"]
    for part in moved_parts:
        X = read_pose(part)
        set_pose(part, RigidTransform(X.rotation(), X.translation() - (x, y, 0.0)))


def read_effort(root: ElementTree.Element, joint: str) -> float:
    """The largest torque that a joint's limits allow, N m; infinite if they are silent."""
    limit = root.find(f"joint[@name='{joint}']/limit")
    effort_limit = 0.0 if limit is None else float(limit.get("effort", "0"))
    return effort_limit if effort_limit > 0.0 else math.inf


def _name_base(root: ElementTree.Element) -> None:
    """Call the robot's base `base_link`; a frame keeps the name that it had."""
    parent_links = {find_link(joint, "child"): find_link(joint, "parent") for joint in root.iterfind("joint[child]")}
    links = [link.get("name", "") for link in root.iterfind("link")]

    def depth(link: str) -> int:
        """Number of links above it."""
        seen_links: list[str | None] = [link]
        while parent_links.get(seen_links[-1]) not in (None, *seen_links):
            seen_links.append(parent_links[seen_links[-1]])
        return len(seen_links)

    roots = [link for link in links if link != "world" and parent_links.get(link) in (None, "world")]
    base_links = [link for link in links if link.endswith("base_link")]
    base_name = (
        "base_link" if "base_link" in links else min(base_links, key=depth, default=roots[0] if len(roots) == 1 else "")
    )
    if base_name in ("", "base_link"):
        return
    for part in root.iter():
        for key in ("name", "link") if part.tag != "joint" else ():
            if part.get(key) == base_name and part.tag in ("link", "parent", "child", "frame"):
                part.set(key, "base_link")
    ElementTree.SubElement(root, "frame", name=base_name, link="base_link", xyz="0 0 0", rpy="0 0 0")


def _reroot_at_base(root: ElementTree.Element) -> None:
    """Turn round the joints above `base_link`, which become fixed, and leave out the link `world`."""
    child_joints = {find_link(joint, "child"): joint for joint in root.iterfind("joint[child]")}
    next_link: str | None = "base_link"
    while (joint := child_joints.pop(next_link, None)) is not None:
        parent, child = joint.find("parent"), joint.find("child")
        next_link = None if parent is None else parent.get("link")
        if next_link is None or next_link == "world":
            root.remove(joint)
            break
        parent.set("link", child.get("link", ""))  # type: ignore[union-attr]
        child.set("link", next_link)  # type: ignore[union-attr]
        set_pose(joint, read_pose(joint).inverse())
        joint.set("type", "fixed")
    world_link = root.find("link[@name='world']")
    if world_link is not None and not any(
        "world" in (find_link(j, "parent"), find_link(j, "child")) for j in root.iter("joint")
    ):
        root.remove(world_link)
