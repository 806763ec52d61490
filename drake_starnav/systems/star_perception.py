"""Each scan is turned into star-shaped regions once, for all consumers."""

import math
from collections.abc import Sequence
from time import perf_counter

from pydrake.common.value import Value
from pydrake.systems.framework import Context, LeafSystem

from drake_starnav.errors import StarnavError
from drake_starnav.lidar.laser_scan import LaserScan
from drake_starnav.lidar.mounts import ON_AXIS, Mount, newest
from drake_starnav.lidar.sensor_model import LidarParameters
from drake_starnav.robot import RobotParameters
from drake_starnav.surroundings.margins import Margins
from drake_starnav.surroundings.perception import Perceive, Perceived, PerceptionSettings, check_views, perceive
from drake_starnav.surroundings.safe_region import SCAN_PATIENCE, CertifiedRegion
from drake_starnav.systems.release import declare_value
from drake_starnav.systems.scan_state import ScanState
from drake_starnav.utils.stopwatch import Stopwatch
from drake_starnav.utils.timing import EARLY


class StarPerception(LeafSystem):
    """Turns laser scans into the planner's star-shaped region and the controller's certified region.

    ```
            ┌────────────────┐
    scan ──>│                ├──> observation
    pose ──>│ StarPerception ├──> certified_region
            └────────────────┘
    ```

    Ports:
        scan: abstract, `LaserScan` in the sensor frame S. Further lidars have the ports scan_2, scan_3, ...
        pose: vector (x, y, yaw) of the robot in the world frame W at the time of the scan, m and rad.
        observation: abstract, `Observation`: the scan, or that of all lidars about the robot's axis, the robot's pose,
            and the region with the planning margin.
        certified_region: abstract, `CertifiedRegion` from the last scans; one that certifies nothing
            if the last scan is older than the delay and three scan periods.

    A new scan with at least one beam that is not lost is in the outputs at once, see `ScanState`; with several lidars,
    once each has one. `perceive` does the work. Lidars whose view is too narrow for the certificate,
    and a pose that is not finite, end the simulation with a `StarnavError`.
    """

    def __init__(
        self,
        robot: RobotParameters,
        margins: Margins,
        lidar: LidarParameters,
        *,
        mounts: Sequence[Mount] = (ON_AXIS,),
        certifies: bool = True,
        perceive: Perceive = perceive,
        stopwatch: Stopwatch | None = None,
    ) -> None:
        """
        Args:
            lidar: its rate and delay; if it declares outliers, they are discarded by `without_outliers` at its noise.
            mounts: where each lidar is on the robot; there are as many ports for scans.
            certifies: whether motion is certified by the certified region, which takes a wide view.
            perceive: the work as a pure function.
            stopwatch: notes `scan` times, if given.
        """
        super().__init__()
        outlier_noise = lidar.noise if lidar.outliers > 0.0 else None
        self._settings = PerceptionSettings(margins, robot.shape, outlier_noise, tuple(mounts))
        self._certifies, self._perceive = certifies, perceive
        self._stopwatch = stopwatch or Stopwatch()
        self._expiry = lidar.delay + SCAN_PATIENCE / lidar.rate
        names = lidar_names("scan", len(mounts))
        self._scans = [self.DeclareAbstractInputPort(name, Value(LaserScan.nothing())) for name in names]
        self._pose = self.DeclareVectorInputPort("pose", 3)
        nothing = Perceived.nothing()
        self._perceived = ScanState(self, nothing, self._after, tuple(self._scans), stamp=self._stamp)
        depends = {self._perceived.ticket}
        seen, fresh = (lambda own, context: own._perceived.Eval(context).observation), StarPerception._fresh_region
        declare_value(self, "observation", nothing.observation, seen, depends)
        declare_value(self, "certified_region", nothing.safety, fresh, depends | {self.time_ticket()})

    def _stamp(self, context: Context) -> float:
        return newest([port.Eval(context) for port in self._scans])

    def _after(self, context: Context, before: Perceived) -> Perceived:
        scans = [port.Eval(context) for port in self._scans]
        if not before.lacks(scans):
            return before
        pose = self._pose.Eval(context).copy()
        if not all(map(math.isfinite, pose.tolist())):
            raise StarnavError(f"the perception's pose is {pose.tolist()}; allowed: finite x, y, m, and yaw, rad")
        settings = self._settings
        if before.observation.region is None and self._certifies:
            backwards = scans[0].motion is not None
            check_views(scans, settings.mounts, settings.footprint, backwards=backwards)
        begin = perf_counter()
        after = self._perceive(before, scans, pose, settings)
        self._stopwatch.note("scan", begin)
        return after

    def _fresh_region(self, context: Context) -> CertifiedRegion:
        safety = self._perceived.Eval(context).safety
        fresh = safety.time - EARLY <= context.get_time() <= safety.time + self._expiry
        return safety if fresh else CertifiedRegion.none()


def lidar_names(name: str, count: int) -> list[str]:
    """What systems and ports of several lidars are called: name, name_2, name_3, ..."""
    return [name, *(f"{name}_{k}" for k in range(2, count + 1))]
