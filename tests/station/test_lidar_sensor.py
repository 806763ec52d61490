import numpy as np
import pytest
from pydrake.common.value import Value
from pydrake.geometry import (
    Cylinder,
    FramePoseVector,
    GeometryFrame,
    GeometryInstance,
    ProximityProperties,
    Role,
    SceneGraph,
    Sphere,
)
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder, LeafSystem

from drake_starnav import LaserScan, LidarParameters, StarnavError
from drake_starnav.station.lidar_sensor import LidarMount, LidarSensor

EXACT = LidarParameters(noise=0.0)
FORWARD = 180  # index of the beam along S's x axis
SPEED, YAW_RATE = 1.0, 2.0


class Carrier(LeafSystem):
    """Poses of frames that translate along W's x axis at a speed and turn at a rate each."""

    def __init__(self, motions):
        super().__init__()
        self._motions = motions  # frame -> (speed, yaw rate)
        self.DeclareAbstractOutputPort("poses", lambda: Value[FramePoseVector](), self._calc)

    def _calc(self, context, output):
        poses = FramePoseVector()
        for frame, (speed, rate) in self._motions.items():
            t = context.get_time()
            poses.set_value(frame, RigidTransform(RotationMatrix.MakeZRotation(rate * t), [speed * t, 0.0, 0.0]))
        output.set_value(poses)


def add_shape(graph, source, frame, shape, X_FG, name):
    instance = GeometryInstance(X_FG, shape, name)
    if frame is None:
        geometry = graph.RegisterAnchoredGeometry(source, instance)
    else:
        geometry = graph.RegisterGeometry(source, frame, instance)
    graph.AssignRole(source, geometry, ProximityProperties())


def build(parameters=EXACT, *, speed=SPEED, yaw_rate=0.0, on_world=False, see_wheel=False, reader=None, **options):
    """A robot (a hull with a wheel) that drives towards a post at x = 3, with a lidar 0.2 m above the ground.

    A `reader` is added, and its inputs connected to the lidar's outputs of the same names.
    """
    builder = DiagramBuilder()
    graph = builder.AddSystem(SceneGraph())
    source = graph.RegisterSource("test")
    hull = graph.RegisterFrame(source, GeometryFrame("hull"))
    wheel = graph.RegisterFrame(source, GeometryFrame("wheel"))
    add_shape(graph, source, hull, Cylinder(0.25, 0.6), RigidTransform(), "hull")
    add_shape(graph, source, wheel, Sphere(0.3), RigidTransform([0.0, 0.4, 0.2]), "wheel")
    add_shape(graph, source, None, Cylinder(0.5, 2.0), RigidTransform([3.0, 0.0, 0.0]), "post")
    carrier = builder.AddSystem(Carrier({hull: (speed, yaw_rate), wheel: (speed, yaw_rate)}))
    builder.Connect(carrier.get_output_port(), graph.get_source_pose_port(source))
    lidar = builder.AddSystem(
        LidarSensor(
            parameters,
            LidarMount(
                SceneGraph.world_frame_id() if on_world else hull,
                RigidTransform([0.0, 0.0, 0.2]),
                () if see_wheel else (wheel,),
            ),
            **options,
        )
    )
    builder.Connect(graph.get_query_output_port(), lidar.GetInputPort("geometry_query"))
    if reader is not None:
        builder.AddSystem(reader)
        for port in map(reader.get_input_port, range(reader.num_input_ports())):
            builder.Connect(lidar.GetOutputPort(port.get_name()), port)
    return builder.Build(), lidar


def scan_of(lidar, root, port="scan"):
    return lidar.GetOutputPort(port).Eval(lidar.GetMyContextFromRoot(root))


def run(until, **options):
    diagram, lidar = build(**options)
    simulator = Simulator(diagram)
    simulator.Initialize()
    simulator.AdvanceTo(until)
    return scan_of(lidar, simulator.get_context())


def test_a_scan_is_held_between_samples():
    diagram, lidar = build()
    simulator = Simulator(diagram)
    for until, time in ((0.049, 0.0), (0.06, 0.05), (0.1001, 0.1), (1.012, 1.0)):
        simulator.AdvanceTo(until)
        scan = scan_of(lidar, simulator.get_context())
        assert scan.time == pytest.approx(time)
        assert scan.ranges[FORWARD] == pytest.approx(2.5 - SPEED * time, abs=1e-9)
        X_WS = scan_of(lidar, simulator.get_context(), "X_WS")
        assert np.allclose(X_WS.translation(), (SPEED * time, 0.0, 0.2), rtol=0.0, atol=1e-12)


def test_a_continuous_sensor_follows_time_and_feeds_through():
    diagram, lidar = build(sampled=False)
    context = diagram.CreateDefaultContext()
    for time in (0.0, 0.013, 0.5):
        context.SetTime(time)
        scan = scan_of(lidar, context)
        assert scan.time == time and scan.ranges[FORWARD] == pytest.approx(2.5 - SPEED * time, abs=1e-9)
    assert scan_of(lidar, context) is scan  # Drake's cache
    assert lidar.HasAnyDirectFeedthrough() and not build()[1].HasAnyDirectFeedthrough()


@pytest.mark.parametrize("delay", [0.013, 0.05, 0.1, 0.12, 0.15, 0.35])
def test_a_late_scan_is_that_of_its_taking(delay):
    late = LidarParameters(noise=0.0, delay=delay)
    diagram, lidar = build(late)
    simulator = Simulator(diagram)
    simulator.AdvanceTo(delay - 1e-3)
    assert scan_of(lidar, simulator.get_context()).lost.all()
    for k in range(31):
        for until in (0.05 * k + delay + 1e-3, 0.05 * (k + 1) + delay - 1e-3):
            simulator.AdvanceTo(until)
            scan = scan_of(lidar, simulator.get_context())
            assert scan.time == pytest.approx(0.05 * k)
            assert scan.ranges[FORWARD] == pytest.approx(2.5 - SPEED * 0.05 * k, abs=1e-9)
            assert scan_of(lidar, simulator.get_context(), "X_WS").translation()[0] == pytest.approx(SPEED * 0.05 * k)


@pytest.mark.parametrize("delay", [0.0, 0.07])
def test_a_lost_scan_leaves_the_last_one_there(delay):
    silent = LidarParameters(noise=0.0, delay=delay, silence_start=0.2, silence_duration=0.3)
    diagram, lidar = build(silent)
    simulator = Simulator(diagram)
    for taken, held in ((0.15, 0.15), (0.2, 0.15), (0.45, 0.15), (0.5, 0.5)):
        simulator.AdvanceTo(taken + delay + 1e-3)
        assert scan_of(lidar, simulator.get_context()).time == pytest.approx(held)


class Reader(LeafSystem):
    """Notes time, the scan's time, and the pose at the instants at which scans are taken."""

    def __init__(self):
        super().__init__()
        self.scan = self.DeclareAbstractInputPort("scan", Value(LaserScan.nothing()))
        self.pose, self.read = self.DeclareVectorInputPort("pose", 3), []
        self.DeclarePeriodicDiscreteUpdateEvent(0.05, 0.0, self.look)

    def look(self, context, _):
        self.read.append((context.get_time(), self.scan.Eval(context).time, *self.pose.Eval(context)))


def test_discrete_updates_of_the_same_instant_see_the_scan_and_its_pose():
    reader = Reader()
    diagram, _ = build(yaw_rate=YAW_RATE, reader=reader)
    Simulator(diagram).AdvanceTo(0.21)
    assert len(reader.read) == 5
    for time, taken, *pose in reader.read:
        assert taken == time
        assert pose == pytest.approx([SPEED * time, 0.0, YAW_RATE * time])


def points_of(parameters, X_WS, frame):
    """The point cloud of one scan of a ball of 1 m radius at (3, 2, 0)."""
    builder = DiagramBuilder()
    graph = builder.AddSystem(SceneGraph())
    add_shape(graph, graph.RegisterSource("test"), None, Sphere(1.0), RigidTransform([3.0, 2.0, 0.0]), "ball")
    lidar = builder.AddSystem(
        LidarSensor(parameters, LidarMount(graph.world_frame_id(), X_WS), point_cloud_frame=frame)
    )
    builder.Connect(graph.get_query_output_port(), lidar.GetInputPort("geometry_query"))
    simulator = Simulator(builder.Build())
    simulator.Initialize()
    return scan_of(lidar, simulator.get_context(), "point_cloud").xyzs().astype(float)


def test_points_are_in_the_sensor_frame_or_the_world():
    X_WS = RigidTransform(RotationMatrix.MakeYRotation(0.3), [1.0, 2.0, 0.5])
    in_S, in_W = (points_of(EXACT, X_WS, frame) for frame in ("S", "W"))
    assert np.allclose(X_WS @ in_S, in_W, rtol=0.0, atol=1e-6)
    assert np.allclose(np.linalg.norm(in_W.T - (3.0, 2.0, 0.0), axis=1), 1.0, rtol=0.0, atol=1e-5)
    assert in_W.shape[1] > 10


def test_own_bodies_are_invisible_unless_wanted():
    assert np.isinf(run(0.0).ranges[270])
    assert run(0.0, see_wheel=True).ranges[270] == pytest.approx(0.1, abs=1e-6)


def test_a_rolling_scan_is_swept_between_two_poses():
    rate = EXACT.rate
    rolling = LidarParameters(noise=0.0, rolling=True)
    still = run(1.0001, parameters=rolling, speed=0.0)
    assert np.allclose(still.ranges, run(1.0001, speed=0.0).ranges, rtol=0.0, atol=1e-9)
    assert np.array_equal(run(0.0, parameters=rolling).ranges, run(0.0).ranges)  # nothing to look back on
    # Beam i looks at the post from where the sensor is at its own time, the last one at the scan's.
    driving = run(1.0001, parameters=rolling)
    assert driving.time_increment == pytest.approx(1.0 / rate / 360) and driving.scan_time == 1.0 / rate
    # Beams that turn clockwise look in the reverse order; 6.28 rad are not quite a turn.
    reverse = LidarParameters(noise=0.0, rolling=True, angle_min=3.0, angle_max=-3.28)
    for scan, beams in ((driving, np.arange(-359, 1)), (run(1.0001, parameters=reverse), np.arange(360))):
        offset = 3.0 - SPEED * (scan.time + beams * scan.time_increment)
        ux, uy = np.cos(scan.bearings), np.sin(scan.bearings)
        under = 0.25 - (offset * uy) ** 2
        exact = np.where((under > 0.0) & (ux > 0.0), offset * ux - np.sqrt(np.maximum(under, 0.0)), np.inf)
        assert np.allclose(scan.ranges, exact, rtol=0.0, atol=1e-9) and scan.hits.sum() > 20
    # A turning sensor sees the post's middle where it was when the beam passed.
    turning = run(1.0001, parameters=rolling, speed=0.0, yaw_rate=0.3)
    hits = np.flatnonzero(turning.hits)
    middle = turning.bearings[hits].mean()
    passed = 1.0 - (1.0 - hits.mean() / 360) / rate
    assert middle == pytest.approx(-0.3 * passed, abs=0.02)


def test_a_rolling_scan_after_a_scan_that_did_not_arrive_begins_where_that_one_ended():
    rolling = {"noise": 0.0, "rolling": True}
    silent = LidarParameters(**rolling, silence_start=0.9, silence_duration=0.1)  # the scans before the one at 1 s
    expected = run(1.0001, parameters=LidarParameters(**rolling))
    assert run(0.9999, parameters=silent).time < 0.9
    assert np.array_equal(run(1.0001, parameters=silent).ranges, expected.ranges)


def test_bad_arguments_are_named():
    mount = LidarMount(SceneGraph.world_frame_id(), RigidTransform())
    for parameters, options, said in (
        (EXACT, {"seed": -1}, "seed is -1; allowed"),
        (EXACT, {"role": Role.kUnassigned}, "role is .*Unassigned; allowed: Role.kProximity"),
        (EXACT, {"point_cloud_frame": "B"}, "point_cloud_frame is 'B'; allowed: 'S', 'W'"),
        (LidarParameters(rolling=True), {"sampled": False}, "rolling is True with sampled=False"),
        (LidarParameters(delay=0.1), {"sampled": False}, "lidar.delay is 0.1, .* with sampled=False; allowed: 0, 0, 0"),
    ):
        with pytest.raises(StarnavError, match=said):
            LidarSensor(parameters, mount, **options)
