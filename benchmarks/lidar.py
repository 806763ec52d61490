"""The lidar's speed and accuracy, side by side with MuJoCo's `mj_multiRay` if `mujoco` is installed.

Run: python benchmarks/lidar.py
"""

import time
from collections.abc import Callable

import numpy as np
from pydrake.geometry import (
    Cylinder,
    FramePoseVector,
    GeometryFrame,
    GeometryInstance,
    PerceptionProperties,
    Role,
    SceneGraph,
)
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.systems.framework import DiagramBuilder

from drake_starnav.lidar import LidarParameters
from drake_starnav.systems.lidar_sensor import LidarSensor

try:
    import mujoco
except ImportError:
    mujoco = None

RADIUS, HEIGHT, DENSITY = 0.15, 2.0, 0.5  # m, m, cylinders per square metre
REPEATS = 200


def forest(count: int) -> np.ndarray:
    """Upright cylinders around the sensor at a fixed density, shape (count, 2), m; none on the sensor itself."""
    rng = np.random.default_rng(0)
    side = np.sqrt(count / DENSITY) / 2.0
    points = rng.uniform(-side, side, (4 * count, 2))
    return points[np.hypot(*points.T) > 0.6][:count]


def best_time(call: Callable[[int], object]) -> float:
    """Median duration of a call, us; the argument is the number of the repetition."""
    call(0)
    times = []
    for k in range(1, REPEATS + 1):
        begin = time.perf_counter()
        call(k)
        times.append(time.perf_counter() - begin)
    return 1e6 * float(np.median(times))


def drake_lidar(posts: np.ndarray, beams: int, tilt: float = 0.0) -> tuple[float, np.ndarray]:
    """Time of one scan evaluation, us, and its ranges; with `tilt`, rad, every scan has a new scan plane."""
    builder = DiagramBuilder()
    graph = builder.AddSystem(SceneGraph())
    source = graph.RegisterSource("benchmark")
    for k, (x, y) in enumerate(posts):
        instance = GeometryInstance(RigidTransform([x, y, HEIGHT / 2.0]), Cylinder(RADIUS, HEIGHT), f"post{k}")
        graph.AssignRole(source, graph.RegisterAnchoredGeometry(source, instance), PerceptionProperties())
    robot = graph.RegisterFrame(source, GeometryFrame("robot"))
    lidar = builder.AddSystem(
        LidarSensor(
            LidarParameters(beams=beams, noise=0.0),
            parent_frame_id=robot,
            X_PS=RigidTransform([0.0, 0.0, 0.5]),
            role=Role.kPerception,  # Drake's proximity role takes memory with the square of the number of shapes
            sampled=False,
        )
    )
    builder.Connect(graph.get_query_output_port(), lidar.GetInputPort("geometry_query"))
    builder.ExportInput(graph.get_source_pose_port(source), "poses")
    diagram = builder.Build()
    root = diagram.CreateDefaultContext()
    context, port = lidar.GetMyContextFromRoot(root), lidar.GetOutputPort("scan")
    poses = FramePoseVector()

    def evaluate(k: int) -> np.ndarray:
        root.SetTime(0.001 * k)
        return port.Eval(context).ranges

    def move(k: int) -> None:
        poses.set_value(robot, RigidTransform(RotationMatrix.MakeXRotation(tilt * (1 + k)), [0.0, 0.0, 0.0]))
        diagram.get_input_port().FixValue(root, poses)

    move(-1)
    ranges = evaluate(-1)
    if tilt:
        return best_time(lambda k: (move(k), evaluate(k))), ranges
    return best_time(evaluate), ranges


def mujoco_rays(posts: np.ndarray, beams: int) -> tuple[float, np.ndarray]:
    """Time of one `mj_multiRay`, us, and its ranges."""
    geoms = "".join(
        f'<geom type="cylinder" size="{RADIUS} {HEIGHT / 2}" pos="{x!r} {y!r} {HEIGHT / 2}"/>'
        for x, y in posts.tolist()
    )
    model = mujoco.MjModel.from_xml_string(f"<mujoco><worldbody>{geoms}</worldbody></mujoco>")
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    angles = -np.pi + 2.0 * np.pi / beams * np.arange(beams)
    directions = np.column_stack((np.cos(angles), np.sin(angles), np.zeros(beams)))
    geom, ranges = np.zeros(beams, dtype=np.int32), np.zeros(beams)
    point, limit = np.array([0.0, 0.0, 0.5]), LidarParameters().range_max
    arguments = {
        "pnt": point,
        "vec": directions.ravel(),
        "geomgroup": None,
        "flg_static": 1,
        "bodyexclude": -1,
        "geomid": geom,
        "dist": ranges,
        "nray": beams,
        "cutoff": limit,
    }
    if "normal" in (mujoco.mj_multiRay.__doc__ or ""):
        arguments["normal"] = None
    duration = best_time(lambda k: mujoco.mj_multiRay(model, data, **arguments))
    return duration, np.where((ranges < 0.0) | (ranges >= limit), np.inf, ranges)


def main() -> None:
    """Print one line per number of beams and cylinders."""
    if mujoco is None:
        print("mujoco is not installed: no comparison")
    few = {}
    for beams in (360, 1080):
        for count in (100, 10000):
            posts = forest(count)
            ours, ranges = drake_lidar(posts, beams)
            line = f"{beams:5d} beams {count:6d} cylinders: {ours:7.1f} us"
            if count > 100:
                line += f" ({ours / few[beams]:.2f} x that of 100)"
            few.setdefault(beams, ours)
            if mujoco is not None:
                theirs, expected = mujoco_rays(posts, beams)
                one = np.isfinite(ranges) != np.isfinite(expected)
                both = np.isfinite(ranges) & np.isfinite(expected)
                line += (
                    f"; mj_multiRay {theirs:9.1f} us, ratio {theirs / ours:7.1f}; largest range difference "
                    f"{np.abs(ranges - expected)[both].max():.1e} m, {one.sum()} beams hit in one only"
                )
            print(line)
    trembling, _ = drake_lidar(forest(100), 360, tilt=1e-4)
    print(f"  360 beams    100 cylinders, new scan plane at each scan: {trembling:7.1f} us")


if __name__ == "__main__":
    main()
