"""No certificate across a jump of the estimated pose."""

import math

from pydrake.common.value import Value
from pydrake.systems.framework import Context, DiscreteValues, EventStatus, LeafSystem

from drake_starnav.surroundings.surroundings import Surroundings
from drake_starnav.systems.release import declare_value
from drake_starnav.utils.timing import check_period


class JumpGuard(LeafSystem):
    """Withholds the surroundings from a jump of the estimated pose until a later scan arrives.

    ```
                    ┌───────────┐
    surroundings ──>│ JumpGuard ├──> surroundings
    state ─────────>│           │
                    └───────────┘
    ```

    Ports:
        surroundings: abstract, `Surroundings`; as output, an empty one if it predates the last jump, and without
            what was seen before that.
        state: vector (x, y, yaw, v, omega) of the robot in the world frame W.

    The last position, its time and that of the last jump are discrete state, brought up to date before each command.
    """

    def __init__(self, *, tolerance: float, rate: float, rolling: bool = False, holonomic: bool = False) -> None:
        """
        Args:
            tolerance: a step that differs by more than this from the one predicted from the speed is a jump, m.
            rate: of the check, Hz: that of the controller's updates.
            rolling: whether the pose of the previous scan also places this one, and so must be later, too.
            holonomic: whether the robot drives in any direction: the speed does not tell in which.
        """
        super().__init__()
        self._tolerance, self._rolling, self._holonomic = tolerance, rolling, holonomic
        self._surroundings = self.DeclareAbstractInputPort("surroundings", Value(Surroundings.unknown()))
        self._state = self.DeclareVectorInputPort("state", 5)
        self.DeclareDiscreteState((math.nan, math.nan, 0.0, -math.inf))
        declare_value(self, "surroundings", Surroundings.unknown(), JumpGuard._guard_surroundings)
        self.DeclarePeriodicDiscreteUpdateEvent(check_period(self, rate=rate), 0.0, self._update)

    def _update(self, context: Context, values: DiscreteValues) -> EventStatus:
        values.set_value(0, self._find_last_jump(context))
        return EventStatus.Succeeded()

    def _find_last_jump(self, context: Context) -> tuple[float, float, float, float]:
        """Return the position now, the time, and when the position last jumped, m and s."""
        last_x, last_y, last_time, jump_time = context.get_discrete_state(0).value()
        time = context.get_time()
        if last_time > time:  # time was set back: another run begins
            last_x, last_y, jump_time = math.nan, math.nan, -math.inf
        x, y, yaw, v, _ = self._state.Eval(context)
        expected_distance = v * (time - last_time)
        if self._holonomic:  # in a direction that the state does not tell
            step = math.hypot(x - last_x, y - last_y) - abs(expected_distance)
        else:
            step = math.hypot(
                x - last_x - expected_distance * math.cos(yaw), y - last_y - expected_distance * math.sin(yaw)
            )
        has_jumped = step > self._tolerance  # never before the first position, which is NaN
        return x, y, time, time if has_jumped else jump_time

    def _guard_surroundings(self, context: Context) -> Surroundings:
        surroundings, jump_time = self._surroundings.Eval(context), self._find_last_jump(context)[3]
        oldest_pose_time = surroundings.previous_time if self._rolling else surroundings.time
        return surroundings.without_views_before(jump_time) if oldest_pose_time >= jump_time else Surroundings.unknown()
