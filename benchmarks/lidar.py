"""The lidar's speed and accuracy, side by side with MuJoCo's `mj_multiRay` if `mujoco` is installed.

Run: python benchmarks/lidar.py

Both are called as their users would from Python, in turns: ours evaluates the port `scan` of a `LidarSensor` at a new
time, MuJoCo's casts the same beams with the sensor's range as cutoff. Medians of the durations are compared. Shapes
have the perception role: with the proximity role Drake takes memory with the square of their number.
"""

import argparse
import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from pydrake.common import MemoryFile
from pydrake.geometry import (
    Box,
    Cylinder,
    FramePoseVector,
    GeometryFrame,
    GeometryInstance,
    InMemoryMesh,
    Mesh,
    PerceptionProperties,
    Role,
    SceneGraph,
    Shape,
)
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.systems.framework import DiagramBuilder

from drake_starnav.lidar.sensor_model import LidarParameters
from drake_starnav.station.lidar_sensor import LidarMount, LidarSensor

try:
    import mujoco
except ImportError:
    mujoco = None

DENSITY = 0.5  # shapes per square metre
HEIGHT = 2.0  # m, of cylinders and walls
SENSOR_HEIGHT = 0.5  # m
RINGS, SECTORS = 20, 25  # of a mesh, which has 2 rings sectors = 1,000 triangles
REPEATS = 300


@dataclass(frozen=True)
class Scene:
    """The same upright shapes at many places.

    Attributes:
        name: for the table.
        shape: in Drake.
        geom: attributes of the same in MuJoCo.
        asset: what the geom needs besides.
        poses: shape (n, 3): x, y, yaw, m and rad.
        height: of the shapes' origins, m.
    """

    name: str
    shape: Shape
    geom: str
    asset: str
    poses: np.ndarray
    height: float


def places(count: int, clear: float) -> np.ndarray:
    """Random poses around the sensor at a fixed density, shape (count, 3); none nearer to it than `clear`, m."""
    rng = np.random.default_rng(0)
    side = np.sqrt(count / DENSITY) / 2.0
    points = rng.uniform((-side, -side, -np.pi), (side, side, np.pi), (4 * count, 3))
    return points[np.hypot(points[:, 0], points[:, 1]) > clear][:count]


def cylinders(count: int) -> Scene:
    """Upright posts."""
    size = f'type="cylinder" size="0.15 {HEIGHT / 2}"'
    return Scene(f"{count} cylinders", Cylinder(0.15, HEIGHT), size, "", places(count, 0.6), HEIGHT / 2)


def walls(count: int) -> Scene:
    """Pieces of wall, each a box of four faces that the lidar can see."""
    size = f'type="box" size="0.5 0.025 {HEIGHT / 2}"'
    return Scene(f"{count} wall segments", Box(1.0, 0.05, HEIGHT), size, "", places(count, 0.8), HEIGHT / 2)


def meshes(count: int) -> Scene:
    """Closed, not convex bodies of 1,000 triangles each."""
    polar, around = np.linspace(0.0, np.pi, RINGS + 2)[1:-1], 2.0 * np.pi / SECTORS * np.arange(SECTORS)
    u, v = np.meshgrid(polar, around, indexing="ij")
    radius = 0.35 * (1.0 + 0.3 * np.sin(5.0 * v) * np.sin(u))
    sides = np.stack((radius * np.sin(u) * np.cos(v), radius * np.sin(u) * np.sin(v), 0.5 * np.cos(u)), axis=-1)
    vertices = np.vstack((sides.reshape(-1, 3), (0.0, 0.0, 0.5), (0.0, 0.0, -0.5)))
    top, bottom, faces = len(vertices) - 2, len(vertices) - 1, []
    for k in range(SECTORS):
        after = (k + 1) % SECTORS
        faces.append((top, k, after))
        faces.append((bottom, (RINGS - 1) * SECTORS + after, (RINGS - 1) * SECTORS + k))
        for ring in range(0, (RINGS - 1) * SECTORS, SECTORS):
            faces.append((ring + k, ring + SECTORS + k, ring + SECTORS + after))
            faces.append((ring + k, ring + SECTORS + after, ring + after))
    obj = "".join(f"v {x!r} {y!r} {z!r}\n" for x, y, z in vertices.tolist())
    obj += "".join(f"f {a + 1} {b + 1} {c + 1}\n" for a, b, c in faces)
    file = MemoryFile(contents=obj, extension=".obj", filename_hint="body.obj")
    numbers = " ".join(map(repr, vertices.ravel().tolist()))
    asset = f'<mesh name="body" vertex="{numbers}" face="{" ".join(map(str, np.ravel(faces)))}"/>'
    name = f"{count} meshes of {len(faces):,} triangles"
    shape = Mesh(InMemoryMesh(mesh_file=file), 1.0)
    return Scene(name, shape, 'type="mesh" mesh="body"', asset, places(count, 0.8), SENSOR_HEIGHT - 0.07)


def drake_lidar(scene: Scene, beams: int) -> tuple[Callable[[int], np.ndarray], Callable[[float], None]]:
    """A function that evaluates one scan, given its number, and one that tilts the sensor by an angle, rad."""
    builder = DiagramBuilder()
    graph = builder.AddSystem(SceneGraph())
    source = graph.RegisterSource("benchmark")
    for k, (x, y, yaw) in enumerate(scene.poses):
        X_WG = RigidTransform(RotationMatrix.MakeZRotation(yaw), [x, y, scene.height])
        instance = GeometryInstance(X_WG, scene.shape, f"shape{k}")
        graph.AssignRole(source, graph.RegisterAnchoredGeometry(source, instance), PerceptionProperties())
    robot = graph.RegisterFrame(source, GeometryFrame("robot"))
    lidar = builder.AddSystem(
        LidarSensor(
            LidarParameters(beams=beams, noise=0.0),
            LidarMount(robot, RigidTransform([0.0, 0.0, SENSOR_HEIGHT])),
            role=Role.kPerception,
            sampled=False,
        )
    )
    builder.Connect(graph.get_query_output_port(), lidar.GetInputPort("geometry_query"))
    builder.ExportInput(graph.get_source_pose_port(source), "poses")
    diagram = builder.Build()
    root = diagram.CreateDefaultContext()
    context, port = lidar.GetMyContextFromRoot(root), lidar.GetOutputPort("scan")
    poses = FramePoseVector()

    def scan(k: int) -> np.ndarray:
        root.SetTime(0.001 * k)
        return port.Eval(context).ranges

    def tilt(angle: float) -> None:
        poses.set_value(robot, RigidTransform(RotationMatrix.MakeXRotation(angle), [0.0, 0.0, 0.0]))
        diagram.get_input_port().FixValue(root, poses)

    tilt(0.0)
    return scan, tilt


def mujoco_rays(scene: Scene, beams: int) -> Callable[[int], np.ndarray]:
    """A function that casts all beams once."""
    geoms = "".join(
        f'<geom {scene.geom} pos="{x!r} {y!r} {scene.height!r}" euler="0 0 {yaw!r}"/>'
        for x, y, yaw in scene.poses.tolist()
    )
    text = f'<compiler angle="radian"/><asset>{scene.asset}</asset><worldbody>{geoms}</worldbody>'
    model = mujoco.MjModel.from_xml_string(f"<mujoco>{text}</mujoco>")
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    angles = -np.pi + 2.0 * np.pi / beams * np.arange(beams)
    geom, ranges = np.zeros(beams, dtype=np.int32), np.zeros(beams)
    limit = LidarParameters().range_max
    arguments = {
        "pnt": np.array([0.0, 0.0, SENSOR_HEIGHT]),
        "vec": np.column_stack((np.cos(angles), np.sin(angles), np.zeros(beams))).ravel(),
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

    def cast(k: int) -> np.ndarray:
        mujoco.mj_multiRay(model, data, **arguments)
        return ranges

    return cast


def durations(*calls: Callable[[int], object]) -> list[float]:
    """Median duration of each call, us, all in turns; the argument is the number of the repetition."""
    times = np.empty((REPEATS, len(calls)))
    for k in range(-5, REPEATS):
        for i, call in enumerate(calls):
            begin = time.perf_counter()
            call(k)
            times[k, i] = time.perf_counter() - begin  # the first ones are overwritten
    return [float(value) for value in 1e6 * np.median(times, axis=0)]


def compare(scene: Scene, beams: int) -> str:
    """One line of the table."""
    scan, _ = drake_lidar(scene, beams)
    head = f"{beams:5d} beams, {scene.name:<32}"
    if mujoco is None:
        return f"{head} {durations(scan)[0]:8.1f} us"
    cast = mujoco_rays(scene, beams)
    ours, theirs = durations(scan, cast)
    ranges, expected = scan(REPEATS), cast(REPEATS).copy()
    expected[(expected < 0.0) | (expected >= LidarParameters().range_max)] = np.inf
    both = np.isfinite(ranges) & np.isfinite(expected)
    one = np.isfinite(ranges) ^ np.isfinite(expected)
    return (
        f"{head} {ours:8.1f} us; mj_multiRay {theirs:8.1f} us, {theirs / ours:5.1f} times as long; "
        f"{both.sum()} hits, largest range difference {np.abs(ranges - expected)[both].max():.1e} m, "
        f"{one.sum()} beams hit in one only"
    )


def main() -> None:
    """Print one line per scene and number of beams."""
    if mujoco is None:
        print("mujoco is not installed: no comparison")
    else:
        print(f"mujoco {mujoco.__version__}")
    for scene in (cylinders(100), walls(400), meshes(50)):
        for beams in (360, 1080):
            print(compare(scene, beams))
    few, many = (drake_lidar(cylinders(count), 360)[0] for count in (100, 10_000))
    ours_few, ours_many = durations(few, many)
    print(f"  360 beams, 10,000 cylinders {ours_many:.1f} us, {ours_many / ours_few:.2f} times that of 100")
    scan, tilt = drake_lidar(cylinders(100), 360)
    trembling = durations(lambda k: (tilt(1e-4 * (k + 10)), scan(k)))[0]
    print(f"  360 beams, 100 cylinders, new scan plane at each scan {trembling:.1f} us")


if __name__ == "__main__":
    argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter).parse_args()
    main()
