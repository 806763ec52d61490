"""A planar lidar for any Drake diagram with a SceneGraph."""

import dataclasses
import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from pydrake.common.value import Value
from pydrake.geometry import FrameId, QueryObject, SceneGraph
from pydrake.math import RigidTransform
from pydrake.perception import PointCloud
from pydrake.systems.framework import Context, EventStatus, LeafSystem, State, ValueProducer

from drake_starnav.errors import StarnavError
from drake_starnav.lidar.laser_scan import LaserScan
from drake_starnav.lidar.raycast import Fan
from drake_starnav.lidar.sensor_model import LidarParameters, arrives, find_released, find_scan_index, measure
from drake_starnav.station.scene_slices import SceneSlices
from drake_starnav.systems.release import declare_value, declare_vector
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
class _SensorState:
    """What a sensor remembers.

    Attributes:
        shown_measurement: at the outputs.
        waiting: measurements in transit, a ring by their index.
        sweep_end: when the last sweep ended, whether its scan arrives or not, s; NaN before the first.
        X_WS_sweep_end: where S was then.
    """

    shown_measurement: _Measurement
    waiting: tuple[_Measurement, ...]
    sweep_end: float
    X_WS_sweep_end: np.ndarray


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

    A scan is taken when a run begins and at each multiple of 1/rate, and held in between as state, an immutable
    snapshot. Discrete updates of the same instant see it already. The noise depends only on the seed and the number of
    the scan.

    A scan appears at the outputs `delay` seconds after it was taken, with the time and `X_WS` at acquisition; if a scan
    is lost, the outputs keep the last one.

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
        seed: int = 0,
        point_cloud_frame: str = "S",
    ) -> None:
        """
        Args:
            mount: where the sensor is, and what it does not see.
            seed: of the noise, a non-negative whole number below 2**64.
            point_cloud_frame: of the points of `point_cloud`, "S" or "W".

        Raises:
            StarnavError: an argument is not allowed. On evaluation: a mesh file cannot be read.
        """
        super().__init__()
        if not 0 <= seed < 2**64:
            raise StarnavError(f"lidar: seed is {seed}; allowed: a whole number, 0 <= seed < 2**64")
        if point_cloud_frame not in ("S", "W"):
            raise StarnavError(f"lidar: point_cloud_frame is {point_cloud_frame!r}; allowed: 'S', 'W'")
        self._parameters = parameters
        self._cloud_in_W = point_cloud_frame == "W"
        self._parent, self._X_PS = mount.parent_frame_id, RigidTransform(mount.X_PS)
        self._seed = int(seed)
        self._fan = Fan.regular(*parameters.field_of_view, parameters.clockwise)
        self._blank_scan = LaserScan(0.0, ranges=np.full(parameters.beams, np.nan), **parameters.scan_fields)
        exclude = {*mount.exclude_frames, mount.parent_frame_id} - {SceneGraph.world_frame_id()}

        self._query_port = self.DeclareAbstractInputPort("geometry_query", Value[QueryObject]())
        # Depends on nothing, so that Drake never discards it: the Context's own memory of slices.
        self._slices = self.DeclareCacheEntry(
            "slices of the scene",
            ValueProducer(
                allocate=lambda: Value[object](SceneSlices(exclude)),
                calc=lambda context, value: value.set_value(SceneSlices(exclude)),
            ),
            {self.nothing_ticket()},
        )
        nothing = _Measurement(self._blank_scan, np.eye(3, 4))
        initial_state = _SensorState(nothing, (nothing,) * parameters.waiting_scans, math.nan, nothing.X_WS)
        self._state = self.DeclareAbstractState(Value[object](initial_state))
        self.DeclareInitializationUnrestrictedUpdateEvent(self._begin)
        period = 1.0 / parameters.rate
        self.DeclarePeriodicUnrestrictedUpdateEvent(period, 0.0, self._update)
        if parameters.delay > 0.0:
            self.DeclarePeriodicUnrestrictedUpdateEvent(period, parameters.release_offset, self._release)
        needs = {self.abstract_state_ticket(self._state)}
        declare_value(self, "scan", nothing.scan, LidarSensor._read_scan, needs)
        declare_vector(self, "ranges", parameters.beams, lambda own, context: own._read_scan(context).ranges, needs)
        declare_value(self, "point_cloud", PointCloud(0), LidarSensor._make_point_cloud, needs)
        declare_value(self, "X_WS", RigidTransform(), LidarSensor._make_pose, needs)
        declare_vector(self, "pose", 3, LidarSensor._make_planar_pose, needs)

    @property
    def parameters(self) -> LidarParameters:
        """The parameters of the sensor."""
        return self._parameters

    def _find_pose(self, query: QueryObject) -> np.ndarray:
        return (query.GetPoseInWorld(self._parent) @ self._X_PS).GetAsMatrix34()

    def _measure(
        self, context: Context, query: QueryObject, X_WS: np.ndarray, X_WS_begin: np.ndarray | None
    ) -> _Measurement:
        p, time = self._parameters, context.get_time()
        distances = self._slices.Eval(context).cast(query, X_WS, self._fan, p.range_max, X_WS_begin)
        ranges = measure(distances, p, self._seed, find_scan_index(time, p.rate))
        return _Measurement(self._blank_scan.again(ranges, time=time), X_WS)

    def _read_state(self, context: Context) -> _SensorState:
        return context.get_abstract_state(self._state).get_value()

    def _read_scan(self, context: Context) -> LaserScan:
        return self._read_state(context).shown_measurement.scan

    def _begin(self, context: Context, state: State) -> EventStatus:
        if not is_new_run(context.get_time(), self._read_state(context).sweep_end):
            return EventStatus.DidNothing()
        return self._update(context, state)

    def _update(self, context: Context, state: State) -> EventStatus:
        last_state, query, time = self._read_state(context), self._query_port.Eval(context), context.get_time()
        X_WS = self._find_pose(query)
        shown_measurement, waiting = last_state.shown_measurement, last_state.waiting
        index = find_scan_index(time, self._parameters.rate)
        if arrives(self._parameters, self._seed, index):
            # No sweep leads to the first scan, nor to its repetition right after initialization.
            is_swept = self._parameters.rolling and last_state.sweep_end < time
            measurement = self._measure(context, query, X_WS, last_state.X_WS_sweep_end if is_swept else None)
            if waiting:
                place = index % len(waiting)
                waiting = (*waiting[:place], measurement, *waiting[place + 1 :])
            else:
                shown_measurement = measurement
        next_state = _SensorState(shown_measurement, waiting, time, X_WS)
        state.get_mutable_abstract_state(self._state).set_value(next_state)
        return EventStatus.Succeeded()

    def _release(self, context: Context, state: State) -> EventStatus:
        """Let the scan that was taken `delay` ago appear, if it arrives."""
        index = find_released(self._parameters, self._seed, context.get_time())
        if index is None:
            return EventStatus.DidNothing()
        value = state.get_mutable_abstract_state(self._state)  # a scan may be taken at the same time
        waiting = value.get_value().waiting
        value.set_value(dataclasses.replace(value.get_value(), shown_measurement=waiting[index % len(waiting)]))
        return EventStatus.Succeeded()

    def _make_point_cloud(self, context: Context) -> PointCloud:
        ranges = self._read_scan(context).ranges
        is_hit = np.isfinite(ranges)
        points = np.zeros((3, int(is_hit.sum())))
        points[:2] = (self._fan.directions[is_hit] * ranges[is_hit, None]).T
        cloud = PointCloud(points.shape[1])
        cloud.mutable_xyzs()[:] = self._make_pose(context) @ points if self._cloud_in_W else points
        return cloud

    def _make_pose(self, context: Context) -> RigidTransform:
        return RigidTransform(self._read_state(context).shown_measurement.X_WS)

    def _make_planar_pose(self, context: Context) -> tuple[float, float, float]:
        (r_xx, _, _, x), (r_yx, _, _, y), _ = self._read_state(context).shown_measurement.X_WS.tolist()
        return x, y, math.atan2(r_yx, r_xx)
