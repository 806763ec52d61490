"""Dynamic obstacles, detected and tracked once for all consumers."""

from time import perf_counter

from pydrake.common.value import Value
from pydrake.systems.framework import Context, LeafSystem

from drake_starnav.geometry.se2 import composed
from drake_starnav.lidar.laser_scan import LaserScan
from drake_starnav.lidar.mounts import ON_AXIS, Mount, newest, unturned
from drake_starnav.lidar.sensor_model import LidarParameters
from drake_starnav.systems.release import declare_value
from drake_starnav.systems.scan_state import ScanState
from drake_starnav.tracking.kalman_tracks import Tracks
from drake_starnav.tracking.parameters import DynamicObstacleParameters
from drake_starnav.tracking.tracker import Tracked, track
from drake_starnav.utils.stopwatch import Stopwatch


class ObstacleTracker(LeafSystem):
    """Distinguishes moving from static hits in each laser scan, and tracks dynamic obstacles.

    ```
             ┌─────────────────┐
    scan ───>│ ObstacleTracker ├──> scan
    pose ───>│                 ├──> tracks
             └─────────────────┘
    ```

    Ports:
        scan: abstract, `LaserScan` in the sensor frame S; as output, the last one with the motion state of each hit.
        pose: vector (x, y, yaw) of the robot in the world frame W at the time of the scan, m and rad.
        tracks: abstract, `Tracks` in W.

    A new scan with at least one beam that is not lost is in the outputs at once, see `ScanState`.
    """

    def __init__(
        self,
        obstacles: DynamicObstacleParameters,
        lidar: LidarParameters,
        mount: Mount = ON_AXIS,
        *,
        stopwatch: Stopwatch | None = None,
    ) -> None:
        """Track what is declared, by a lidar with these errors there; a stopwatch, if given, notes `track` times."""
        super().__init__()
        self._mount, self._flip = mount, ON_AXIS._replace(upside_down=mount.upside_down)
        self._obstacles, self._range_deviation = obstacles, lidar.range_deviation
        self._stopwatch = stopwatch or Stopwatch()
        self._scan = self.DeclareAbstractInputPort("scan", Value(LaserScan.nothing()))
        self._pose = self.DeclareVectorInputPort("pose", 3)
        self._tracked = ScanState(self, Tracked(), self._after, (self._scan, self._pose), stamp=self._stamp)
        depends = {self._tracked.ticket}
        declare_value(self, "scan", Tracked().scan, ObstacleTracker._last_scan, depends)
        declare_value(self, "tracks", Tracks(), lambda own, context: own._tracked.Eval(context).tracks, depends)

    def _stamp(self, context: Context) -> float:
        return newest([self._scan.Eval(context)])

    def _after(self, context: Context, before: Tracked) -> Tracked:
        scan = self._scan.Eval(context)
        if scan.time == before.tracks.time:
            return before
        begin = perf_counter()
        place = composed(self._pose.Eval(context), self._mount[:3])
        after = track(before, unturned(scan, self._flip), place, self._obstacles, self._range_deviation)
        self._stopwatch.note("track", begin)
        return after

    def _last_scan(self, context: Context) -> LaserScan:
        return unturned(self._tracked.Eval(context).scan, self._flip)
