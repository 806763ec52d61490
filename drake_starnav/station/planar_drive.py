"""An ideal planar base: three joints from the floor to base_link, with velocity servos."""

import math

import numpy as np
from pydrake.geometry import ProximityProperties
from pydrake.math import RigidTransform
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import (
    FixedOffsetFrame,
    Joint,
    PdControllerGains,
    PrismaticJoint,
    RevoluteJoint,
    SpatialInertia,
    UnitInertia,
)
from pydrake.systems.framework import Context, LeafSystem

from drake_starnav.robot import RobotParameters
from drake_starnav.station.robot_geometry import RobotModel
from drake_starnav.systems.release import declare_vector

JOINTS = {
    "x": (PrismaticJoint, np.array([1.0, 0.0, 0.0])),
    "y": (PrismaticJoint, np.array([0.0, 1.0, 0.0])),
    "yaw": (RevoluteJoint, np.array([0.0, 0.0, 1.0])),
}
"""From the floor on, with their type and axis."""
LIGHT_INERTIA = SpatialInertia(0.001, np.zeros(3), UnitInertia(0.001, 0.001, 0.001))
"""Of the bodies between two joints, kg and kg m^2."""


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
        """Drive by a robot's base and limits."""
        super().__init__()
        self._robot = robot
        self._twist = self.DeclareVectorInputPort("twist_command", 3)
        self._state = self.DeclareVectorInputPort("multibody_state", 6)
        declare_vector(self, "desired_state", 6, PlanarVelocityCommand._compute_desired_state)

    def _compute_desired_state(self, context: Context) -> tuple[float, ...]:
        x, y, omega = self._robot.drive.saturate(self._twist.Eval(context), self._robot.limits).tolist()
        yaw = float(self._state.Eval(context)[2])
        cosine, sine = math.cos(yaw), math.sin(yaw)
        return 0.0, 0.0, 0.0, cosine * x - sine * y, sine * x + cosine * y, omega


def put_on_joints(robot: RobotModel, height: float, start: tuple[float, float, float]) -> None:
    """Hang base_link, so high above the floor, m, on joints with motors, and let it not touch the floor.

    The plant is not yet finalized; the start is (x, y, yaw), m and rad, W.
    """
    plant, bodies = robot.plant, [robot.plant.get_body(index) for index in robot.poses()]
    for geometry in robot.shapes(*bodies):
        robot.keep_off_floor(geometry, ProximityProperties(robot.inspector.GetProximityProperties(geometry)))
    mass = sum(body.default_mass() for body in bodies)
    yaw_inertia = sum(body.default_rotational_inertia().get_moments()[2] for body in bodies)
    frame_name = f"floor_of_{plant.GetModelInstanceName(robot.index)}"
    parent = plant.AddFrame(FixedOffsetFrame(frame_name, plant.world_frame(), RigidTransform([0.0, 0.0, height])))
    for name, value, inert in zip(JOINTS, start, (mass, mass, yaw_inertia), strict=True):
        kind, axis = JOINTS[name]
        body = robot.base if name == "yaw" else plant.AddRigidBody(f"floor_{name}", robot.index, LIGHT_INERTIA)
        joint = plant.AddJoint(kind(f"floor_{name}", parent, body.body_frame(), axis))
        joint.set_default_positions(np.array([value]))
        _add_servo(plant, joint, inert)
        parent = body.body_frame()


def _add_servo(plant: MultibodyPlant, joint: Joint, inertia: float) -> None:
    """Let a motor without a limit hold the speed of a joint that moves a mass, kg, or an inertia, kg m^2."""
    actuator = plant.AddJointActuator(joint.name(), joint, math.inf)
    actuator.set_controller_gains(PdControllerGains(p=0.0, d=inertia / 0.004))  # s, within which it follows
