"""Dynamic obstacles, detected and tracked once for all consumers."""

from collections.abc import Sequence
from functools import partial
from time import perf_counter

from pydrake.common.value import Value
from pydrake.systems.framework import Context, LeafSystem

from drake_starnav.geometry.se2 import compose_poses
from drake_starnav.lidar.laser_scan import LaserScan
from drake_starnav.lidar.mounts import ON_AXIS, Mount, align_with_robot, find_newest
from drake_starnav.lidar.sensor_model import LidarParameters
from drake_starnav.moving.kalman_tracks import Tracks
from drake_starnav.moving.parameters import DynamicObstacleParameters
from drake_starnav.moving.tracker import TrackerState, join_tracks, track
from drake_starnav.systems.release import declare_value
from drake_starnav.systems.scan_state import ScanState
from drake_starnav.systems.star_perception import lidar_names
from drake_starnav.utils.stopwatch import Stopwatch


class ObstacleTracker(LeafSystem):
    """Distinguishes moving from static hits in each laser scan, and tracks dynamic obstacles.

    With several lidars there are as many ports for scans, named scan, scan_2, scan_3, ..., of either direction.

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
        mounts: Sequence[Mount] = (ON_AXIS,),
        *,
        stopwatch: Stopwatch | None = None,
    ) -> None:
        """Track what is declared, by lidars with these errors there; a stopwatch, if given, notes `track` times."""
        super().__init__()
        self._mounts = tuple(mounts)
        self._obstacles, self._range_deviation = obstacles, lidar.range_deviation
        self._stopwatch = stopwatch or Stopwatch()
        names = lidar_names("scan", len(self._mounts))
        self._scans = [self.DeclareAbstractInputPort(name, Value(LaserScan.nothing())) for name in names]
        self._pose, blind = self.DeclareVectorInputPort("pose", 3), (TrackerState(),) * len(names)
        self._tracked = ScanState(self, blind, self._step_state, (*self._scans, self._pose), stamp=self._stamp)
        depends = {self._tracked.ticket}
        for k, name in enumerate(names):
            declare_value(self, name, blind[k].scan, partial(ObstacleTracker._last_scan, number=k), depends)
        declare_value(self, "tracks", Tracks(), ObstacleTracker._tracks, depends)

    def _stamp(self, context: Context) -> float:
        return find_newest([port.Eval(context) for port in self._scans])

    def _step_state(self, context: Context, previous_states: tuple[TrackerState, ...]) -> tuple[TrackerState, ...]:
        scans = [port.Eval(context) for port in self._scans]
        pose = self._pose.Eval(context)
        next_states = list(previous_states)
        time = find_newest(scans)
        new = [k for k, scan in enumerate(scans) if find_newest([scan]) == time != previous_states[k].tracks.time]
        if not new:
            return previous_states
        begin = perf_counter()
        for k in new:
            scan, place = align_with_robot(scans[k], _flip(self._mounts[k])), compose_poses(pose, self._mounts[k][:3])
            next_states[k] = track(previous_states[k], scan, place, self._obstacles, self._range_deviation)
        self._stopwatch.note("track", begin)
        return tuple(next_states)

    def _last_scan(self, context: Context, number: int) -> LaserScan:
        return align_with_robot(self._tracked.Eval(context)[number].scan, _flip(self._mounts[number]))

    def _tracks(self, context: Context) -> Tracks:
        return join_tracks(self._tracked.Eval(context), self._obstacles)


def _flip(mount: Mount) -> Mount:
    return ON_AXIS._replace(upside_down=mount.upside_down)
