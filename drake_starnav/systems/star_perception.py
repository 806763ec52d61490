"""Each scan made into star-shaped regions once, for everybody who needs them."""

import dataclasses
from dataclasses import dataclass

import numpy as np
from pydrake.common.value import AbstractValue, Value
from pydrake.systems.framework import Context, EventStatus, LeafSystem, State

from drake_starnav.control import ControllerParameters
from drake_starnav.roadmap import Observation, PlannerParameters
from drake_starnav.robot import RobotParameters
from drake_starnav.scan import LaserScan
from drake_starnav.stars.averaging import averaged
from drake_starnav.stars.free_range import free_range, smoothed_distances
from drake_starnav.stars.outliers import HitHistory, without_strays
from drake_starnav.stars.parameters import StarParameters
from drake_starnav.stars.region import fit_region
from drake_starnav.stars.safety import SafetyStar, ScanMemory, safety_star
from drake_starnav.stopwatch import Stopwatch
from drake_starnav.sweep import taken_at_once

AVERAGED = 0.5
"""With `average_scans`, hits nearer to the robot than this are averaged, m: they hem it in."""

EARLY = 1e-6
"""A scan may come from so far in the future by rounding, s."""


@dataclass(frozen=True)
class _Perceived:
    observation: Observation
    safety: SafetyStar
    memory: ScanMemory
    history: HitHistory

    @staticmethod
    def nothing() -> "_Perceived":
        return _Perceived(Observation.none(), SafetyStar.none(), ScanMemory(), HitHistory())

    def __deepcopy__(self, memo: dict) -> "_Perceived":
        return self  # immutable: Drake's copies of abstract state cost nothing


class StarPerception(LeafSystem):
    """Turns each laser scan into the planner's star-shaped region and the controller's safety star.

    ```
             ┌────────────────┐
    scan ───>│ StarPerception ├──> star
    pose ───>│                ├──> safety_star
             └────────────────┘
    ```

    Ports:
        scan: abstract, `LaserScan` in the sensor frame S, whose origin is the robot's centre.
        pose: vector (x, y, yaw) of S in the world frame W at the time of the scan, m and rad.
        star: abstract, `Observation`: the scan, its pose, and its region with the planning margin.
        safety_star: abstract, `SafetyStar` from the last `controller.scan_memory` scans; one that certifies nothing
            when the last scan is older than the delay and `controller.scan_patience` scan periods.

    Updates periodically at the lidar's rate, `offset` seconds after it, if there is a scan that it has not seen and
    that says anything; the last scans are abstract state. A rolling scan is made into one taken at once.
    """

    def __init__(
        self,
        robot: RobotParameters,
        planner: PlannerParameters,
        controller: ControllerParameters,
        *,
        rate: float,
        offset: float,
        delay: float = 0.0,
        confirm: float | None = None,
        stopwatch: Stopwatch | None = None,
    ) -> None:
        """
        Args:
            robot: its radius.
            planner: of the regions.
            controller: of the safety star.
            rate: of the lidar, Hz.
            offset: from the lidar's update to this one, s; at least one step of the plant.
            delay: from a scan to its arrival, s.
            confirm: where not None, stray hits are sorted out as `without_strays` does at this noise, m.
            stopwatch: where to note `scan` and `fit` times, if anywhere.
        """
        super().__init__()
        self._robot, self._planner, self._controller = robot, planner, controller
        self._hit_smoothing = StarParameters(
            smoothing_beams=controller.smoothed_beams, smoothing_slack=planner.smoothing_slack
        )
        self._stopwatch = stopwatch or Stopwatch()
        self._confirm = confirm
        self._expiry = delay + controller.scan_patience / rate
        self._scan = self.DeclareAbstractInputPort("scan", Value(LaserScan.nothing()))
        self._pose = self.DeclareVectorInputPort("pose", 3)
        nothing = _Perceived.nothing()
        self._state = self.DeclareAbstractState(Value(nothing))
        depends = {self.abstract_state_ticket(self._state)}
        self.DeclareAbstractOutputPort("star", lambda: Value(nothing.observation), self._calc_star, depends)
        self.DeclareAbstractOutputPort(
            "safety_star",
            lambda: Value(nothing.safety),
            self._calc_safety_star,
            depends | {self.time_ticket()},
        )
        self.DeclarePeriodicUnrestrictedUpdateEvent(1.0 / rate, offset, self._update)

    def _update(self, context: Context, state: State) -> EventStatus:
        scan = self._scan.Eval(context)
        before = context.get_abstract_state(self._state).get_value()
        if scan.time == before.safety.time or scan.lost.all():
            return EventStatus.DidNothing()
        if scan.time < before.safety.time:
            before = _Perceived.nothing()  # time was set back: another run begins
        pose = self._pose.Eval(context).copy()
        controller, radius = self._controller, self._robot.radius
        with self._stopwatch.measure("scan"):
            if scan.time_increment > 0.0 and before.observation.region is not None:
                scan = taken_at_once(scan, before.observation.pose, before.observation.scan.time, pose)
            history, near = before.history, scan  # what the certificate sees
            if self._confirm is not None:
                history = history.remembered(scan.points(pose))
                near, scan = without_strays(scan, pose, before.history, self._confirm, radius)
            distance = smoothed_distances(scan, self._planner)
            if controller.smoothed_beams > 0:
                smooth = smoothed_distances(near, self._hit_smoothing)
                near = dataclasses.replace(near, ranges=np.where(near.hits, smooth, near.ranges))
            profile = free_range(scan, distance, radius, self._planner)
            with self._stopwatch.measure("fit"):
                region = fit_region(profile, pose[:2], pose[2] + scan.angle_min, self._planner)
            safe_radius = radius + controller.safety_margin
            kept = controller.safety_range + 2.0 * safe_radius, controller.scan_memory, controller.scan_spacing
            memory = known = before.memory.remembered(near, pose, *kept)
            if controller.average_scans and near.motion is None:
                earlier, near = averaged(before.memory, near, pose, safe_radius + AVERAGED)
                known = earlier.remembered(near, pose, *kept)
            safety = safety_star(known, near, distance, pose, safe_radius, controller.safety_range, self._planner)
            safety = dataclasses.replace(safety, previous=before.safety.time)
        seen = _Perceived(Observation(region, scan, pose), safety, memory, history)
        state.get_mutable_abstract_state(self._state).set_value(seen)
        return EventStatus.Succeeded()

    def _calc_star(self, context: Context, output: AbstractValue) -> None:
        output.set_value(context.get_abstract_state(self._state).get_value().observation)

    def _calc_safety_star(self, context: Context, output: AbstractValue) -> None:
        safety = context.get_abstract_state(self._state).get_value().safety
        fresh = safety.time - EARLY <= context.get_time() <= safety.time + self._expiry
        output.set_value(safety if fresh else SafetyStar.none())
