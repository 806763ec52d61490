"""A planar lidar for any Drake diagram with a SceneGraph."""

import dataclasses
import math
from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
from pydrake.common.value import AbstractValue, Value
from pydrake.geometry import FrameId, QueryObject, Role, SceneGraph
from pydrake.math import RigidTransform
from pydrake.perception import PointCloud
from pydrake.systems.framework import Context, EventStatus, LeafSystem, State, ValueProducer

from drake_starnav.errors import StarnavError
from drake_starnav.lidar.laser_scan import LaserScan
from drake_starnav.lidar.raycast import Fan
from drake_starnav.lidar.sensor_model import LidarParameters, arrives, find_released, find_scan_index, measure
from drake_starnav.station.scene_slices import SceneSlices
from drake_starnav.systems.release import declare_value, declare_vector, weakly
from drake_starnav.utils.snapshot import snapshot
from drake_starnav.utils.timing import is_new_run


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


class _Measurement(NamedTuple):
    """One scan, and where S was when it was taken: the upper rows of `X_WS`, shape (3, 4)."""

    scan: LaserScan
    X_WS: np.ndarray


@snapshot
class _Held:
    """What a sampled sensor knows.

    The scan at the outputs; scans in transit, a ring by their index; when the last sweep ended, whether its scan
    arrives or not, s, NaN before the first; and where S was then.
    """

    shown: _Measurement
    waiting: tuple[_Measurement, ...]
    swept: float
    X_WS_swept: np.ndarray


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

    With `sampled=True` a scan is taken when a run begins and at each multiple of 1/rate, and held in between as state,
    an immutable snapshot. Discrete updates of the same instant see it already. With `sampled=False` the outputs follow
    the inputs continuously and there is direct feedthrough; the noise still changes only at multiples of 1/rate. The
    noise depends only on the seed and the number of the scan.

    A sampled scan appears at the outputs `delay` seconds after it was taken, with the time and `X_WS` at acquisition;
    if a scan is lost, the outputs keep the last one.

    Beams are listed counter-clockwise. With `rolling`, beam i of n is measured at the share (i + 1)/n of the time since
    the previous scan (the first scan is taken at one instant), the last one at the scan's time; in the reverse order if
    they turn clockwise. The sensor is assumed to move uniformly in between; the motion of other bodies within a sweep
    is neglected.

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
        self._fan = Fan.regular(*parameters.field_of_view, parameters.clockwise)
        self._blank = LaserScan(0.0, ranges=np.full(parameters.beams, np.nan), **parameters.scan_fields)
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
        nothing = _Measurement(self._blank, np.eye(3, 4))
        if sampled:
            initial_scans = _Held(nothing, (nothing,) * parameters.waiting_scans, math.nan, nothing.X_WS)
            self._state = self.DeclareAbstractState(Value[object](initial_scans))
            self.DeclareInitializationUnrestrictedUpdateEvent(self._begin)
            period = 1.0 / parameters.rate
            self.DeclarePeriodicUnrestrictedUpdateEvent(period, 0.0, self._update)
            if parameters.delay > 0.0:
                self.DeclarePeriodicUnrestrictedUpdateEvent(period, parameters.release_offset, self._release)
            self._measured: Callable[[Context], _Measurement] = weakly(self._read_shown)
            needs = {self.abstract_state_ticket(self._state)}
        else:
            measurement = self.DeclareCacheEntry(
                "measurement",
                ValueProducer(allocate=lambda: Value[object](nothing), calc=weakly(self._measure)),
                {self._query_port.ticket(), self.time_ticket()},
            )
            self._measured, needs = measurement.Eval, {measurement.ticket()}
        declare_value(self, "scan", nothing.scan, lambda own, context: own._measured(context).scan, needs)
        beams = parameters.beams
        declare_vector(self, "ranges", beams, lambda own, context: own._measured(context).scan.ranges, needs)
        declare_value(self, "point_cloud", PointCloud(0), LidarSensor._make_point_cloud, needs)
        declare_value(self, "X_WS", RigidTransform(), LidarSensor._X_WS, needs)
        declare_vector(self, "pose", 3, LidarSensor._make_planar_pose, needs)

    @property
    def parameters(self) -> LidarParameters:
        """The parameters of the sensor."""
        return self._parameters

    def _find_pose(self, query: QueryObject) -> np.ndarray:
        return (query.GetPoseInWorld(self._parent) @ self._X_PS).GetAsMatrix34()

    def _cast(
        self, context: Context, query: QueryObject, X_WS: np.ndarray, X_WS_begin: np.ndarray | None = None
    ) -> _Measurement:
        p, time = self._parameters, context.get_time()
        distances = self._slices.Eval(context).cast(query, X_WS, self._fan, p.range_max, X_WS_begin)
        ranges = measure(distances, p, self._seed, find_scan_index(time, p.rate))
        return _Measurement(self._blank.again(ranges, time=time), X_WS)

    def _measure(self, context: Context, measurement: AbstractValue) -> None:
        query = self._query_port.Eval(context)
        measurement.set_value(self._cast(context, query, self._find_pose(query)))

    def _read_state(self, context: Context) -> _Held:
        return context.get_abstract_state(self._state).get_value()

    def _read_shown(self, context: Context) -> _Measurement:
        return self._read_state(context).shown

    def _begin(self, context: Context, state: State) -> EventStatus:
        if not is_new_run(context.get_time(), self._read_state(context).swept):
            return EventStatus.DidNothing()
        return self._update(context, state)

    def _update(self, context: Context, state: State) -> EventStatus:
        held_scans, query, time = self._read_state(context), self._query_port.Eval(context), context.get_time()
        X_WS = self._find_pose(query)
        shown_ranges = held_scans.shown
        waiting = held_scans.waiting
        index = find_scan_index(time, self._parameters.rate)
        if arrives(self._parameters, self._seed, index):
            # No sweep leads to the first scan, nor to its repetition right after initialization.
            begin = held_scans.X_WS_swept if self._parameters.rolling and held_scans.swept < time else None
            measured_ranges = self._cast(context, query, X_WS, begin)
            if waiting:
                at = index % len(waiting)
                waiting = (*waiting[:at], measured_ranges, *waiting[at + 1 :])
            else:
                shown_ranges = measured_ranges
        state.get_mutable_abstract_state(self._state).set_value(_Held(shown_ranges, waiting, time, X_WS))
        return EventStatus.Succeeded()

    def _release(self, context: Context, state: State) -> EventStatus:
        """Let the scan that was taken `delay` ago appear, if it arrives."""
        index = find_released(self._parameters, self._seed, context.get_time())
        if index is None:
            return EventStatus.DidNothing()
        held_scans = state.get_mutable_abstract_state(self._state)  # a scan may be taken at the same time
        waiting = held_scans.get_value().waiting
        held_scans.set_value(dataclasses.replace(held_scans.get_value(), shown=waiting[index % len(waiting)]))
        return EventStatus.Succeeded()

    def _make_point_cloud(self, context: Context) -> PointCloud:
        measured_scan = self._measured(context)
        ranges = measured_scan.scan.ranges
        hit = np.isfinite(ranges)
        points = np.zeros((3, int(hit.sum())))
        points[:2] = (self._fan.directions[hit] * ranges[hit, None]).T
        cloud = PointCloud(points.shape[1])
        cloud.mutable_xyzs()[:] = RigidTransform(measured_scan.X_WS) @ points if self._cloud_in_W else points
        return cloud

    def _X_WS(self, context: Context) -> RigidTransform:
        return RigidTransform(self._measured(context).X_WS)

    def _make_planar_pose(self, context: Context) -> tuple[float, float, float]:
        (r_xx, _, _, x), (r_yx, _, _, y), _ = self._measured(context).X_WS.tolist()
        return x, y, math.atan2(r_yx, r_xx)
