"""A path given in advance in the place of a planner, e.g. a trajectory from Drake's own planners."""

import numpy as np
from pydrake.common.value import Value
from pydrake.systems.framework import Context, DiscreteValues, EventStatus, LeafSystem

from drake_starnav.errors import StarnavError
from drake_starnav.geometry.polyline import resampled
from drake_starnav.lidar.laser_scan import USUAL_BODY
from drake_starnav.planning.guidance import Guidance
from drake_starnav.surroundings.observation import Observation
from drake_starnav.systems.release import declare_value, declare_vector

SPACING = 0.2
"""Distance between way points, in radii of the robot."""
NEAR, FAR = 2.8, 14.0
"""How far ahead along the path its way point lies, in radii: at least, and at most, where something stands in it."""
PERIOD = 0.05
"""Period of the updates, s: a few centimetres at walking speed."""


class FixedPath(LeafSystem):
    """Leads along a given path: to the first way point a little ahead that the robot sees to be free.

    ```
                   ┌───────────┐
    observation ──>│ FixedPath ├──> guidance
    pose ─────────>│           ├──> short_term_goal
                   └───────────┘
    ```

    Ports:
        observation: abstract, `Observation` of the latest scan.
        pose: vector (x, y, yaw) of the robot in the world frame W, m and rad.
        guidance: abstract, `Guidance` for the controller, with the region of that scan.
        short_term_goal: vector (x, y) in W, m; the robot's own position before the first scan.

    Progress along the path is discrete state, as a path may cross itself.
    """

    def __init__(self, path: np.ndarray, robot_radius: float = USUAL_BODY) -> None:
        """
        Args:
            path: shape (n, 2), from near the robot to where it stops, W, m.
            robot_radius: its narrow radius, m.

        Raises:
            StarnavError: the path has another shape, no point, or is not finite.
        """
        super().__init__()
        way = Guidance.along(path).path
        if not len(way):
            raise StarnavError("path has no way point; allowed: shape (n, 2) with n >= 1")
        self._path = resampled(way, SPACING * robot_radius)
        self._observation = self.DeclareAbstractInputPort("observation", Value(Observation.none()))
        self._pose = self.DeclareVectorInputPort("pose", 3)
        self._passed = self.DeclareDiscreteState(1)
        declare_value(self, "guidance", Guidance.none(), FixedPath._guidance)
        declare_vector(self, "short_term_goal", 2, FixedPath._short_term_goal)
        self.DeclarePeriodicDiscreteUpdateEvent(PERIOD, 0.0, self._update)

    def _between(self, context: Context, near: float, far: float) -> slice:
        """Way points from `near` to `far` beyond the one passed, radii; at least one."""
        passed = int(context.get_discrete_state(self._passed)[0])
        first, last = (passed + round(distance / SPACING) for distance in (near, far))
        return slice(min(first, len(self._path) - 1), last + 1)

    def _update(self, context: Context, values: DiscreteValues) -> EventStatus:
        window = self._between(context, 0.0, NEAR)
        distances = np.hypot(*(self._path[window] - self._pose.Eval(context)[:2]).T)
        values.set_value(self._passed, [window.start + int(distances.argmin())])
        return EventStatus.Succeeded()

    def _guidance(self, context: Context) -> Guidance:
        region = self._observation.Eval(context).region
        if region is None:
            return Guidance.none()
        window = self._between(context, NEAR, FAR)
        free = int(region.contains(self._path[window]).argmax())  # the nearest one where none is
        return Guidance.along(self._path[window.start + free :], [region])

    def _short_term_goal(self, context: Context) -> np.ndarray:
        path = self._guidance(context).path
        return path[0] if len(path) else self._pose.Eval(context)[:2]
