"""Where a robot's model carries its lidars."""

import math
from collections.abc import Sequence

from pydrake.math import RigidTransform, RollPitchYaw
from pydrake.multibody.tree import FrameIndex

from drake_starnav.errors import StarnavError
from drake_starnav.lidar.mounts import Mount
from drake_starnav.lidar.sensor_model import LidarParameters
from drake_starnav.station.robot_geometry import RobotModel

ALIKE = ("lidar", "laser", "scan", "hokuyo", "velodyne", "rplidar", "ouster", "sick", "lds")
"""Parts of the names that lidars' frames have."""
TOLERANCE = 1e-3
"""Within which a lidar counts as level, on the axis or unturned, m and rad."""


def lidar_poses(robot: RobotModel, lidars: Sequence[LidarParameters]) -> list[RigidTransform]:
    """Of the frame of each lidar in base_link, with all joints at zero.

    Raises:
        StarnavError: the model has no such frame, or the frame is not joined to base_link.
    """
    plant, model, links, poses = robot.plant, robot.index, robot.poses(), []
    for lidar in lidars:
        if not plant.HasFrameNamed(lidar.frame, model):
            raise StarnavError(
                f"lidar.frame is {lidar.frame}; allowed: a link or frame of the robot's model, "
                f"{', '.join(_candidates(robot))}"
            )
        frame = plant.GetFrameByName(lidar.frame, model)
        X_BL = links.get(frame.body().index())
        if X_BL is None:
            raise StarnavError(f"frame {lidar.frame} is not joined to link base_link; allowed: a joint between them")
        poses.append(X_BL @ frame.GetFixedPoseInBodyFrame())
    return poses


def mount_of(X_BS: RigidTransform, frame: str) -> Mount:
    """The mount of a sensor frame S of that name at a pose in base_link; a `StarnavError` if it is not level."""
    upward, (x, y, _) = float(X_BS.rotation().matrix()[2, 2]), X_BS.translation().tolist()
    if abs(upward) < math.cos(TOLERANCE):
        roll, pitch, yaw = RollPitchYaw(X_BS.rotation()).vector() + 0.0  # no -0
        raise StarnavError(
            f"frame {frame} is turned by roll {roll:g}, pitch {pitch:g}, yaw {yaw:g} rad in base_link; allowed: a "
            "level lidar, upright or upside down"
        )
    ahead = X_BS.rotation().matrix()[:2, 0]
    yaw = math.atan2(ahead[1], ahead[0])
    if math.hypot(x, y) <= TOLERANCE:
        x = y = 0.0
    return Mount(x, y, yaw if abs(yaw) > TOLERANCE else 0.0, upward < 0.0)


def _candidates(robot: RobotModel) -> list[str]:
    """Names of the model's frames that may be lidars'; if there are none, of all but those of joints."""
    frames = (robot.plant.get_frame(FrameIndex(k)) for k in range(robot.plant.num_frames()))
    joints = [joint.name() for joint in robot.joints]
    hidden = {f"{joint}_{side}" for joint in joints for side in ("parent", "child")} | {"", "__model__"}
    names = sorted({frame.name() for frame in frames if frame.model_instance() == robot.index} - hidden)
    return [name for name in names if any(part in name.lower() for part in ALIKE)] or names
