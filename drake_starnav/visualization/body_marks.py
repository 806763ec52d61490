"""Marks on top of bodies: what the robot covers, where its front is, and how fast obstacles move."""

import math

import numpy as np

from drake_starnav.geometry.footprint import Footprint
from drake_starnav.visualization import meshes
from drake_starnav.visualization.meshcat_stage import MeshcatStage
from drake_starnav.worlds.moving_obstacles import MovingObstacles, moving_obstacle_states

LEAST_SPEED = 0.02
"""An obstacle slower than this has no arrow, m/s."""


class BodyMarks:
    """Draws into a stage; each mark is an object that moves with its body, and drawn anew only where it changes."""

    def __init__(self, stage: MeshcatStage, obstacles: MovingObstacles, scale: float) -> None:
        """`obstacles`: those that move; `scale`: of the world's marks, see `meshes.choose_mark_scale`."""
        self._stage, self._obstacles, self._scale = stage, obstacles, scale
        self.clear()

    def clear(self) -> None:
        """Forget what has been drawn."""
        self._shape: Footprint | None = None
        self._speeds = np.zeros(len(self._obstacles))

    def draw_robot(self, pose: np.ndarray, shape: Footprint, time: float) -> None:
        """The rim and the front of a footprint at a pose (x, y, yaw), W, from a time on."""
        for layer in ("footprint", "front"):
            self._stage.move(layer, "robot", pose, time)
        if shape is self._shape:
            return
        self._shape = shape
        width = 0.5 * self._scale * meshes.LINE_WIDTH
        self._stage.swap("footprint", meshes.make_rim(shape, min(width, 0.2 * shape.cover_radius)), time, key="robot")
        self._stage.swap("front", meshes.make_front(shape, 2.0 * width), time, key="robot")

    def draw_velocities(self, time: float) -> None:
        """Arrows from the middles of obstacles to where they will be in 1 s at their velocities at a time, s."""
        positions, velocities = (row[0] for row in moving_obstacle_states(self._obstacles, np.array([time])))
        for k, ((x, y), (vx, vy)) in enumerate(zip(positions, velocities, strict=True)):
            speed = math.hypot(vx, vy) if math.hypot(vx, vy) > LEAST_SPEED else 0.0
            if speed > 0.0:
                self._stage.move("velocities", f"{k}", np.array((x, y, math.atan2(vy, vx))), time)
            if abs(speed - self._speeds[k]) > 0.1 * self._speeds[k]:
                arrow = (
                    meshes.make_arrow(speed, 0.7 * self._scale * meshes.LINE_WIDTH) if speed > 0.0 else meshes.NOTHING
                )
                self._stage.swap("velocities", arrow, time, key=f"{k}")
                self._speeds[k] = speed
