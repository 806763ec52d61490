"""A planar lidar for any Drake diagram with a SceneGraph."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from pydrake.common.value import AbstractValue, Value
from pydrake.geometry import FrameId, QueryObject, Role, SceneGraph
from pydrake.math import RigidTransform
from pydrake.perception import PointCloud
from pydrake.systems.framework import BasicVector, Context, EventStatus, LeafSystem, State, ValueProducer

from drake_starnav.errors import StarnavError
from drake_starnav.lidar import LidarParameters, measure, scan_index
from drake_starnav.raycast import Fan
from drake_starnav.scan import LaserScan
from drake_starnav.systems.geometry_slices import SceneSlices


@dataclass(frozen=True)
class _Measurement:
    """One scan and where it was taken."""

    scan: LaserScan
    X_WS: RigidTransform

    def __deepcopy__(self, memo: dict) -> "_Measurement":
        return self  # nobody changes it: Drake's copies of abstract state cost nothing


class LidarSensor(LeafSystem):
    """Measures the distance from the sensor frame S to the shapes of a SceneGraph, along beams in S's x-y plane.

    ```
                      ┌─────────────┐
                      │             ├──> scan
    geometry_query ──>│ LidarSensor ├──> ranges
                      │             ├──> point_cloud
                      │             ├──> X_WS
                      └─────────────┘
    ```

    Ports:
        geometry_query: abstract, `QueryObject` of the scene.
        scan: abstract, `LaserScan`, m and rad, in S. Before the first scan, one that measured nothing.
        ranges: vector of size `beams`, m, as in `scan`: `+inf` no return, `-inf` too close.
        point_cloud: abstract, `pydrake.perception.PointCloud` of the finite ranges, m, in S.
        X_WS: abstract, `RigidTransform` of S in the world frame W at the time of the scan.

    S is fixed to a parent frame P by `X_PS` and may be mounted at any height and tilt; bearings are counter-clockwise
    about S's z axis from its x axis. Shapes of P itself are invisible (unless P is the world frame), and so are those
    of `exclude_frames`: name there the other bodies of the robot that carries the sensor. A beam sees surfaces from
    either side. Meshes are seen as they are, not as their convex hulls; deformable geometry is not seen.

    With `sampled=True` a scan is taken at initialization and at each multiple of 1/rate, and held in between. With
    `sampled=False` the outputs follow the inputs continuously and there is direct feedthrough; the noise still
    changes only at multiples of 1/rate. The noise depends on the seed and the number of the scan alone.

    With `rolling`, the beams are swept in order over the time since the previous scan (the first scan is taken at
    once), the last one being measured at the scan's time; the other bodies' motion within a sweep is neglected.

    The system is defined for T = double only.
    """

    def __init__(
        self,
        parameters: LidarParameters,
        *,
        parent_frame_id: FrameId,
        X_PS: RigidTransform,
        exclude_frames: Sequence[FrameId] = (),
        role: Role = Role.kProximity,
        seed: int = 0,
        sampled: bool = True,
    ) -> None:
        """
        Args:
            parameters: of the sensor.
            parent_frame_id: SceneGraph frame P that carries the sensor; `SceneGraph.world_frame_id()` is allowed.
            X_PS: pose of S in P.
            exclude_frames: further frames whose shapes are invisible.
            role: shapes without it are invisible.
            seed: of the noise, a non-negative whole number below 2**64.
            sampled: take scans periodically and hold them, or evaluate on demand.

        Raises:
            StarnavError: the seed is out of range, or a rolling sensor is not sampled.
        """
        super().__init__()
        if not 0 <= seed < 2**64:
            raise StarnavError(f"lidar: seed is {seed}; allowed: a whole number, 0 <= seed < 2**64")
        if parameters.rolling and not sampled:
            raise StarnavError("lidar.rolling is True with sampled=False; allowed: rolling with sampled=True")
        self._parameters = parameters
        self._parent = parent_frame_id
        self._X_PS = RigidTransform(X_PS)
        self._seed = int(seed)
        self._fan = Fan.regular(parameters.angle_min, parameters.angle_increment, parameters.beams)
        exclude = {*exclude_frames, parent_frame_id} - {SceneGraph.world_frame_id()}

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
        nothing = self._nothing = _Measurement(self._scan(0.0, np.full(parameters.beams, np.inf)), RigidTransform())
        self._state = self._entry = None
        if sampled:
            self._state = self.DeclareAbstractState(Value[object](nothing))
            self.DeclareInitializationUnrestrictedUpdateEvent(self._update)
            self.DeclarePeriodicUnrestrictedUpdateEvent(1.0 / parameters.rate, 0.0, self._update)
            needs = {self.abstract_state_ticket(self._state)}
        else:
            self._entry = self.DeclareCacheEntry(
                "measurement",
                ValueProducer(
                    allocate=lambda: Value[object](nothing),
                    calc=lambda context, value: value.set_value(self._measure(context)),
                ),
                {self._query_port.ticket(), self.time_ticket()},
            )
            needs = {self._entry.ticket()}
        self.DeclareAbstractOutputPort("scan", lambda: Value[object](nothing.scan), self._calc_scan, needs)
        self.DeclareVectorOutputPort("ranges", parameters.beams, self._calc_ranges, needs)
        self.DeclareAbstractOutputPort(
            "point_cloud", lambda: AbstractValue.Make(PointCloud(0)), self._calc_point_cloud, needs
        )
        self.DeclareAbstractOutputPort("X_WS", lambda: AbstractValue.Make(RigidTransform()), self._calc_X_WS, needs)

    @property
    def parameters(self) -> LidarParameters:
        """The parameters of the sensor."""
        return self._parameters

    def _scan(self, time: float, ranges: np.ndarray) -> LaserScan:
        p = self._parameters
        return LaserScan(time, p.angle_min, p.angle_increment, p.range_min, p.range_max, ranges)

    def _measure(self, context: Context, X_WS_begin: RigidTransform | None = None) -> _Measurement:
        query = self._query_port.Eval(context)
        X_WS = query.GetPoseInWorld(self._parent) @ self._X_PS
        slices = self._slices.Eval(context)
        distances = slices.cast(query, X_WS, self._fan, self._parameters.range_max, X_WS_begin)
        time = context.get_time()
        index = scan_index(time, self._parameters.rate)
        return _Measurement(self._scan(time, measure(distances, self._parameters, self._seed, index)), X_WS)

    def _update(self, context: Context, state: State) -> EventStatus:
        X_WS_begin = None
        if self._parameters.rolling:
            last = self._held(context)
            # No sweep leads to the first scan, nor to its repetition right after initialization.
            if last is not self._nothing and last.scan.time < context.get_time():
                X_WS_begin = last.X_WS
        state.get_mutable_abstract_state(self._state).set_value(self._measure(context, X_WS_begin))
        return EventStatus.Succeeded()

    def _held(self, context: Context) -> _Measurement:
        if self._entry is not None:
            return self._entry.Eval(context)
        return context.get_abstract_state(self._state).get_value()

    def _calc_scan(self, context: Context, output: AbstractValue) -> None:
        output.set_value(self._held(context).scan)

    def _calc_ranges(self, context: Context, output: BasicVector) -> None:
        output.SetFromVector(self._held(context).scan.ranges)

    def _calc_point_cloud(self, context: Context, output: AbstractValue) -> None:
        ranges = self._held(context).scan.ranges
        hit = np.isfinite(ranges)
        cloud = PointCloud(int(hit.sum()))
        xyz = cloud.mutable_xyzs()
        xyz[:2] = (self._fan.directions[hit] * ranges[hit, None]).T
        xyz[2] = 0.0
        output.set_value(cloud)

    def _calc_X_WS(self, context: Context, output: AbstractValue) -> None:
        output.set_value(self._held(context).X_WS)
