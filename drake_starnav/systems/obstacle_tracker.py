"""Dynamic obstacles, detected and tracked once for all consumers."""

from pydrake.common.value import AbstractValue, Value
from pydrake.systems.framework import Context, EventStatus, LeafSystem, State

from drake_starnav.lidar.laser_scan import LaserScan
from drake_starnav.systems.release import weakly
from drake_starnav.tracking import DynamicObstacleParameters, Tracks
from drake_starnav.tracking.tracker import Tracked, track
from drake_starnav.utils.stopwatch import Stopwatch
from drake_starnav.utils.timing import checked_period


class ObstacleTracker(LeafSystem):
    """Distinguishes moving from static hits in each laser scan, and tracks dynamic obstacles.

    ```
             ┌─────────────────┐
    scan ───>│ ObstacleTracker ├──> scan
    pose ───>│                 ├──> tracks
             └─────────────────┘
    ```

    Ports:
        scan: abstract, `LaserScan` in the sensor frame S, whose origin is the robot's centre; as output, the last one
            with the motion state of each hit.
        pose: vector (x, y, yaw) of S in the world frame W at the time of the scan, m and rad.
        tracks: abstract, `Tracks` in W.

    Updates periodically at the lidar's rate, `offset` seconds after it, if there is a new scan
    with at least one beam that is not lost; the tracker's state is abstract state.
    """

    def __init__(
        self, obstacles: DynamicObstacleParameters, *, rate: float, offset: float, stopwatch: Stopwatch | None = None
    ) -> None:
        """
        Args:
            obstacles: what is declared about dynamic obstacles.
            rate: of the lidar, Hz.
            offset: from the lidar's update to this one, s; at least one step of the plant.
            stopwatch: where to note `track` times, if anywhere.
        """
        super().__init__()
        self._obstacles, self._stopwatch = obstacles, stopwatch or Stopwatch()
        self._scan = self.DeclareAbstractInputPort("scan", Value(LaserScan.nothing()))
        self._pose = self.DeclareVectorInputPort("pose", 3)
        self._state = self.DeclareAbstractState(Value(Tracked()))
        depends = {self.abstract_state_ticket(self._state)}
        self.DeclareAbstractOutputPort("scan", lambda: Value(Tracked().scan), weakly(self._calc_scan), depends)
        self.DeclareAbstractOutputPort("tracks", lambda: Value(Tracks()), weakly(self._calc_tracks), depends)
        period = checked_period(self, rate=rate, offset=offset)
        self.DeclarePeriodicUnrestrictedUpdateEvent(period, offset, self._update)

    def _update(self, context: Context, state: State) -> EventStatus:
        scan = self._scan.Eval(context)
        before = context.get_abstract_state(self._state).get_value()
        if scan.time == before.tracks.time or scan.lost.all():
            return EventStatus.DidNothing()
        if scan.time < before.tracks.time:  # time was set back: another run begins
            before = Tracked()
        pose = self._pose.Eval(context).copy()
        with self._stopwatch.measure("track"):
            after = track(before, scan, pose, self._obstacles)
        state.get_mutable_abstract_state(self._state).set_value(after)
        return EventStatus.Succeeded()

    def _calc_scan(self, context: Context, output: AbstractValue) -> None:
        output.set_value(context.get_abstract_state(self._state).get_value().scan)

    def _calc_tracks(self, context: Context, output: AbstractValue) -> None:
        output.set_value(context.get_abstract_state(self._state).get_value().tracks)
