"""An ideal planar base: three joints from the floor to base_link, with velocity servos."""

import math
from xml.etree import ElementTree

import numpy as np
from pydrake.geometry import ProximityProperties
from pydrake.multibody.tree import PdControllerGains
from pydrake.systems.framework import BasicVector, Context, LeafSystem

from drake_starnav.robot import RobotParameters
from drake_starnav.station.robot_geometry import RobotModel
from drake_starnav.systems.release import weakly

JOINTS = {"x": ("prismatic", "1 0 0"), "y": ("prismatic", "0 1 0"), "yaw": ("continuous", "0 0 1")}
"""From the floor on, with their type and axis."""


class PlanarVelocityCommand(LeafSystem):
    """Turns a twist into the desired state of the joints of a planar base, and no twist beyond the robot's limits.

    ```
                        ┌───────────────────────┐
    twist_command ─────>│                       │
                        │ PlanarVelocityCommand ├──> desired_state
    multibody_state ───>│                       │
                        └───────────────────────┘
    ```

    Ports:
        twist_command: vector (v_x, v_y, omega) in the robot's frame, m/s and rad/s; cut off at the limits.
        multibody_state: vector of the robot's model, from the plant; its third position is the yaw.
        desired_state: vector of three positions (zero and unused, as is their gain), and speeds along W's x and y, m/s,
            and about z, rad/s.
    """

    def __init__(self, *, robot: RobotParameters) -> None:
        """Of a robot's base and limits."""
        super().__init__()
        self._robot = robot
        self._twist = self.DeclareVectorInputPort("twist_command", 3)
        self._state = self.DeclareVectorInputPort("multibody_state", 6)
        self.DeclareVectorOutputPort("desired_state", 6, weakly(self._calc_state))

    def _calc_state(self, context: Context, output: BasicVector) -> None:
        x, y, omega = self._robot.drive.saturated(self._twist.Eval(context), self._robot.limits).tolist()
        yaw = float(self._state.Eval(context)[2])
        cosine, sine = math.cos(yaw), math.sin(yaw)
        output.SetFromVector((0.0, 0.0, 0.0, cosine * x - sine * y, sine * x + cosine * y, omega))


def put_on_joints(root: ElementTree.Element, height: float) -> None:
    """Hang `base_link`, so high above the floor (m), on the joints of a planar base."""
    parent = "world"
    for name, (kind, axis) in JOINTS.items():
        child = "base_link" if name == "yaw" else f"floor_{name}"
        if child != "base_link":
            inertial = ElementTree.SubElement(ElementTree.SubElement(root, "link", name=child), "inertial")
            ElementTree.SubElement(inertial, "mass", value="0.001")  # kg
            moments = {"ixx": "1e-6", "iyy": "1e-6", "izz": "1e-6", "ixy": "0", "ixz": "0", "iyz": "0"}
            ElementTree.SubElement(inertial, "inertia", moments)
        joint = ElementTree.SubElement(root, "joint", name=f"floor_{name}", type=kind)
        if parent == "world":
            ElementTree.SubElement(joint, "origin", xyz=f"0 0 {height!r}")
        ElementTree.SubElement(joint, "parent", link=parent)
        ElementTree.SubElement(joint, "child", link=child)
        ElementTree.SubElement(joint, "axis", xyz=axis)
        parent = child


def motorize(robot: RobotModel, start: tuple[float, float, float]) -> None:
    """Give the joints of a planar base their motors and the start, (x, y, yaw), m and rad, W, and let it not touch the
    floor.

    The plant is not yet finalized; its model was read from a file with `put_on_joints`.
    """
    plant, bodies = robot.plant, [robot.plant.get_body(index) for index in robot.poses()]
    for geometry in robot.shapes(*bodies):
        robot.keep_off_floor(geometry, ProximityProperties(robot.inspector.GetProximityProperties(geometry)))
    mass = sum(body.default_mass() for body in bodies)
    inertia = sum(body.default_rotational_inertia().get_moments()[2] for body in bodies)
    for name, value, inert in zip(JOINTS, start, (mass, mass, inertia), strict=True):
        joint = plant.GetJointByName(f"floor_{name}", robot.index)
        joint.set_default_positions(np.array([value]))
        actuator = plant.AddJointActuator(joint.name(), joint, math.inf)
        actuator.set_controller_gains(PdControllerGains(p=0.0, d=inert / 0.004))  # s, within which it follows
