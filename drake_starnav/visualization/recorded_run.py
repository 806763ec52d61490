"""A recorded run with everything needed to draw pictures of it."""

from dataclasses import dataclass

from drake_starnav.geometry.footprint import Footprint
from drake_starnav.geometry.trajectory import Motion
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
        shape: of its hull.
        color: of its hull, red, green, blue, 0 to 1.
        deck: size of the lighter deck on it, as a share of the hull's.
    """

    motion: Motion
    shape: Footprint
    color: Color = SHELL_COLOR
    deck: float = 0.86


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
