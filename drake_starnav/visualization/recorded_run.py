"""A recorded run with everything needed to draw pictures of it."""

from dataclasses import dataclass

import numpy as np

from drake_starnav.geometry.trajectory import Motion
from drake_starnav.robot import RobotParameters
from drake_starnav.visualization.camera import Extent
from drake_starnav.visualization.meshes import SHELL_COLOR, Color
from drake_starnav.visualization.page import Caption
from drake_starnav.visualization.scene_timeline import SceneTimeline
from drake_starnav.visualization.timeline import Timeline


@dataclass(frozen=True)
class RobotTrack:
    """A robot that drives through the scene.

    Attributes:
        motion: its poses.
        radius: of its hull, m.
        color: of its hull, red, green, blue, 0 to 1.
        deck: size of the lighter deck on it, as a share of the hull's.
        outline: corners of its hull in its frame, shape (n, 2), m; None: it is round.
    """

    motion: Motion
    radius: float
    color: Color = SHELL_COLOR
    deck: float = 0.86
    outline: np.ndarray | None = None


def outline_of(robot: RobotParameters) -> np.ndarray | None:
    """The `outline` of a robot."""
    return None if robot.shape.is_disc else robot.shape.outline


@dataclass(frozen=True)
class RecordedRun:
    """A recorded run.

    Attributes:
        caption: text beside the scene.
        extent: the box of the floor that is shown, W, m.
        scene: obstacles and all else that is solid, but the robots.
        timeline: drawings on the floor.
        robots: the robots; the camera follows the first.
    """

    caption: Caption
    extent: Extent
    scene: SceneTimeline
    timeline: Timeline
    robots: tuple[RobotTrack, ...]

    @property
    def duration(self) -> float:
        """Time of the last pose, s."""
        return max(robot.motion.duration for robot in self.robots)
