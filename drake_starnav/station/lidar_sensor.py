"""A planar lidar for any Drake diagram with a SceneGraph."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from pydrake.common.value import AbstractValue, Value
from pydrake.geometry import FrameId, QueryObject, Role, SceneGraph
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.perception import PointCloud
from pydrake.systems.framework import BasicVector, Context, EventStatus, LeafSystem, State, ValueProducer

from drake_starnav.errors import StarnavError
from drake_starnav.geometry.raycast import Fan
from drake_starnav.lidar.laser_scan import LaserScan
from drake_starnav.lidar.sensor_model import LidarParameters, arrives, measure, released, scan_index
from drake_starnav.station.scene_slices import SceneSlices
from drake_starnav.systems.release import weakly
from drake_starnav.utils.timing import begins_run

TAKEN = 13
"""Size of the state that holds when and where a scan was taken."""


class LidarMount(NamedTuple):
    """Where a lidar is mounted.

    Attributes:
        parent_frame_id: SceneGraph frame P that carries the sensor; `SceneGraph.world_frame_id()` is allowed.
        X_PS: pose of the sensor frame S in P.
        exclude_frames: further frames whose shapes are invisible.
    """

    parent_frame_id: FrameId
    X_PS: RigidTransform
    exclude_frames: Sequence[FrameId] = ()


@dataclass(frozen=True)
class _Measurement:
    """One scan, and when and where it was taken, as `_packed`."""

    scan: LaserScan
    taken: np.ndarray

    @property
    def X_WS(self) -> RigidTransform:
        """Pose of the sensor frame at acquisition."""
        return _unpacked(self.taken)[1]


class LidarSensor(LeafSystem):
    """Measures the distance from the sensor frame S to the shapes of a SceneGraph, along beams in S's x-y plane.

    ```
                      ┌─────────────┐
                      │             ├──> scan
    geometry_query ──>│ LidarSensor ├──> ranges
                      │             ├──> point_cloud
                      │             ├──> X_WS
                      │             ├──> pose
                      └─────────────┘
    ```

    Ports:
        geometry_query: abstract, `QueryObject` of the scene.
        scan: abstract, `LaserScan`, m and rad, in S. Before the first scan, one whose beams are all lost.
        ranges: vector of size `beams`, m, as in `scan`: `+inf` no return, `-inf` too close, NaN lost.
        point_cloud: abstract, `pydrake.perception.PointCloud` of the finite ranges, m, in S, or in the world frame W
            with `point_cloud_frame="W"`.
        X_WS: abstract, `RigidTransform` of S in the world frame W at the time of the scan.
        pose: vector (x, y, yaw) of S in W at the time of the scan, m and rad.

    S is fixed to a parent frame P by the mount's `X_PS` and may be mounted at any height and tilt; bearings are
    counter-clockwise about S's z axis from its x axis. Shapes of P itself are invisible (unless P is the world frame),
    and so are those of the mount's `exclude_frames`: list there the other bodies of the robot that carries the sensor.
    A beam detects surfaces from either side. Meshes are seen as they are, not as their convex hulls; deformable
    geometry is not seen.

    With `sampled=True` a scan is taken when a run begins and at each multiple of 1/rate, and held in between as
    discrete state: its ranges, its time and `X_WS`. Discrete updates of the same instant see it already. With
    `sampled=False` the outputs follow the inputs continuously and there is direct feedthrough; the noise still changes
    only at multiples of 1/rate. The noise depends only on the seed and the number of the scan.

    A sampled scan appears at the outputs `delay` seconds after it was taken, with the time and `X_WS` at acquisition;
    if a scan is lost, the outputs keep the last one.

    With `rolling`, beam i of n is measured at the share (i + 1)/n of the time since the previous scan (the first scan
    is taken at once), the last one at the scan's time. The sensor is assumed to move uniformly in between; the other
    bodies' motion within a sweep is neglected.

    The system is defined for T = double only.
    """

    def __init__(
        self,
        parameters: LidarParameters,
        mount: LidarMount,
        *,
        role: Role = Role.kProximity,
        seed: int = 0,
        sampled: bool = True,
        point_cloud_frame: str = "S",
    ) -> None:
        """
        Args:
            parameters: of the sensor.
            mount: where the sensor is, and what it does not see.
            role: shapes without it are invisible.
            seed: of the noise, a non-negative whole number below 2**64.
            sampled: take scans periodically and hold them, or evaluate on demand.
            point_cloud_frame: of the points of `point_cloud`, "S" or "W".

        Raises:
            StarnavError: an argument is not allowed, or a rolling sensor is not sampled. On evaluation: a mesh file
                cannot be read.
        """
        super().__init__()
        if not 0 <= seed < 2**64:
            raise StarnavError(f"lidar: seed is {seed}; allowed: a whole number, 0 <= seed < 2**64")
        if parameters.rolling and not sampled:
            raise StarnavError("lidar.rolling is True with sampled=False; allowed: rolling with sampled=True")
        if (parameters.delay or parameters.scan_loss or parameters.silence_duration) and not sampled:
            raise StarnavError(
                f"lidar.delay is {parameters.delay:g}, lidar.scan_loss {parameters.scan_loss:g}, "
                f"lidar.silence_duration {parameters.silence_duration:g} with sampled=False; allowed: 0, 0, 0"
            )
        if role not in (Role.kProximity, Role.kPerception, Role.kIllustration):
            raise StarnavError(f"lidar: role is {role}; allowed: Role.kProximity, Role.kPerception, Role.kIllustration")
        if point_cloud_frame not in ("S", "W"):
            raise StarnavError(f"lidar: point_cloud_frame is {point_cloud_frame!r}; allowed: 'S', 'W'")
        self._parameters = parameters
        self._cloud_in_W = point_cloud_frame == "W"
        self._parent, self._X_PS = mount.parent_frame_id, RigidTransform(mount.X_PS)
        self._seed = int(seed)
        self._fan = Fan.regular(parameters.angle_min, parameters.angle_increment, parameters.beams)
        self._before = LaserScan(
            time=0.0,
            ranges=np.full(parameters.beams, np.nan),
            angle_min=parameters.angle_min,
            angle_increment=parameters.angle_increment,
            range_min=parameters.range_min,
            range_max=parameters.range_max,
            time_increment=parameters.time_increment,
            scan_time=1.0 / parameters.rate,
            lost_beams=True,
        )
        exclude = {*mount.exclude_frames, mount.parent_frame_id} - {SceneGraph.world_frame_id()}

        self._query_port = self.DeclareAbstractInputPort("geometry_query", Value[QueryObject]())
        # Depends on nothing, so that Drake never discards it: the Context's own memory of slices.
        self._slices = self.DeclareCacheEntry(
            "slices of the scene",
            ValueProducer(
                allocate=lambda: Value[object](SceneSlices(role, exclude)),
                calc=lambda context, value: value.set_value(SceneSlices(role, exclude)),
            ),
            {self.nothing_ticket()},
        )
        unseen = _packed(math.nan, RigidTransform())
        nothing = _Measurement(self._before, unseen)
        if sampled:
            self._ranges = self.DeclareDiscreteState(nothing.scan.ranges)
            self._taken = self.DeclareDiscreteState(unseen)
            self._swept = self.DeclareDiscreteState(unseen)  # the end of the last sweep, whether it arrives or not
            self._waiting = [
                self.DeclareDiscreteState(np.concatenate((unseen, nothing.scan.ranges)))
                for _ in range(parameters.waiting_scans)
            ]
            self.DeclareInitializationUnrestrictedUpdateEvent(self._begin)
            self.DeclarePeriodicUnrestrictedUpdateEvent(1.0 / parameters.rate, 0.0, self._update)
            if parameters.delay > 0.0:
                self.DeclarePeriodicUnrestrictedUpdateEvent(
                    1.0 / parameters.rate, parameters.release_offset, self._release
                )
            calc, needs = weakly(self._recall), {self.discrete_state_ticket(k) for k in (self._ranges, self._taken)}
        else:
            calc, needs = weakly(self._measure), {self._query_port.ticket(), self.time_ticket()}
        self._measurement = self.DeclareCacheEntry(
            "measurement",
            ValueProducer(
                allocate=lambda: Value[object](nothing), calc=lambda context, value: value.set_value(calc(context))
            ),
            needs,
        )
        needs = {self._measurement.ticket()}
        self.DeclareAbstractOutputPort("scan", lambda: Value[object](nothing.scan), weakly(self._calc_scan), needs)
        self.DeclareVectorOutputPort("ranges", parameters.beams, weakly(self._calc_ranges), needs)
        self.DeclareAbstractOutputPort(
            "point_cloud", lambda: AbstractValue.Make(PointCloud(0)), weakly(self._calc_point_cloud), needs
        )
        self.DeclareAbstractOutputPort(
            "X_WS", lambda: AbstractValue.Make(RigidTransform()), weakly(self._calc_X_WS), needs
        )
        self.DeclareVectorOutputPort("pose", 3, weakly(self._calc_pose), needs)

    @property
    def parameters(self) -> LidarParameters:
        """The parameters of the sensor."""
        return self._parameters

    def _pose(self, query: QueryObject) -> RigidTransform:
        return query.GetPoseInWorld(self._parent) @ self._X_PS

    def _cast(
        self, context: Context, query: QueryObject, X_WS: RigidTransform, X_WS_begin: RigidTransform | None = None
    ) -> np.ndarray:
        p = self._parameters
        distances = self._slices.Eval(context).cast(query, X_WS, self._fan, p.range_max, X_WS_begin)
        return measure(distances, p, self._seed, scan_index(context.get_time(), p.rate))

    def _measure(self, context: Context) -> _Measurement:
        query = self._query_port.Eval(context)
        X_WS, time = self._pose(query), context.get_time()
        scan = self._before.measured_at(time, self._cast(context, query, X_WS))
        return _Measurement(scan, _packed(time, X_WS))

    def _begin(self, context: Context, state: State) -> EventStatus:
        if not begins_run(context.get_time(), context.get_discrete_state(self._swept)[0]):
            return EventStatus.DidNothing()
        return self._update(context, state)

    def _update(self, context: Context, state: State) -> EventStatus:
        query = self._query_port.Eval(context)
        X_WS, X_WS_begin = self._pose(query), None
        if self._parameters.rolling:
            last, X_WS_last = _unpacked(context.get_discrete_state(self._swept).value())
            # No sweep leads to the first scan, nor to its repetition right after initialization.
            if last < context.get_time():
                X_WS_begin = X_WS_last
        values = state.get_mutable_discrete_state()
        taken = _packed(context.get_time(), X_WS)
        values.set_value(self._swept, taken)
        index = scan_index(context.get_time(), self._parameters.rate)
        if not arrives(self._parameters, self._seed, index):
            return EventStatus.Succeeded()
        ranges = self._cast(context, query, X_WS, X_WS_begin)
        if self._waiting:
            values.set_value(self._waiting[index % len(self._waiting)], np.concatenate((taken, ranges)))
        else:
            values.set_value(self._ranges, ranges)
            values.set_value(self._taken, taken)
        return EventStatus.Succeeded()

    def _release(self, context: Context, state: State) -> EventStatus:
        """Let the scan that was taken `delay` ago appear, if it arrives."""
        index = released(self._parameters, self._seed, context.get_time())
        if index is None:
            return EventStatus.DidNothing()
        scan = context.get_discrete_state(self._waiting[index % len(self._waiting)]).value().copy()
        values = state.get_mutable_discrete_state()
        values.set_value(self._taken, scan[:TAKEN])
        values.set_value(self._ranges, scan[TAKEN:])
        return EventStatus.Succeeded()

    def _recall(self, context: Context) -> _Measurement:
        taken = context.get_discrete_state(self._taken).value().copy()
        ranges, time = context.get_discrete_state(self._ranges).value().copy(), float(taken[0])
        return _Measurement(self._before.measured_at(0.0 if math.isnan(time) else time, ranges), taken)

    def _calc_scan(self, context: Context, output: AbstractValue) -> None:
        output.set_value(self._measurement.Eval(context).scan)

    def _calc_ranges(self, context: Context, output: BasicVector) -> None:
        output.SetFromVector(self._measurement.Eval(context).scan.ranges)

    def _calc_point_cloud(self, context: Context, output: AbstractValue) -> None:
        measured = self._measurement.Eval(context)
        ranges = measured.scan.ranges
        hit = np.isfinite(ranges)
        points = np.zeros((3, int(hit.sum())))
        points[:2] = (self._fan.directions[hit] * ranges[hit, None]).T
        cloud = PointCloud(points.shape[1])
        cloud.mutable_xyzs()[:] = measured.X_WS @ points if self._cloud_in_W else points
        output.set_value(cloud)

    def _calc_X_WS(self, context: Context, output: AbstractValue) -> None:
        output.set_value(self._measurement.Eval(context).X_WS)

    def _calc_pose(self, context: Context, output: BasicVector) -> None:
        R_WS, p_WS = np.split(self._measurement.Eval(context).taken[1:].reshape(3, 4), (3,), axis=1)
        output.SetFromVector((p_WS[0, 0], p_WS[1, 0], math.atan2(R_WS[1, 0], R_WS[0, 0])))


def _packed(time: float, X_WS: RigidTransform) -> np.ndarray:
    """When and where a scan was taken, as discrete state; no time, NaN, before the first."""
    state = np.empty(TAKEN)
    state[0], state[1:] = time, X_WS.GetAsMatrix34().ravel()
    return state


def _unpacked(state: np.ndarray) -> tuple[float, RigidTransform]:
    matrix = state[1:].reshape(3, 4)
    return float(state[0]), RigidTransform(RotationMatrix(matrix[:, :3]), matrix[:, 3])
