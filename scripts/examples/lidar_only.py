"""The lidar alone, in a plain Drake scene without a robot: one scan of several shapes, summarised.

Run: python scripts/examples/lidar_only.py
"""

import numpy as np
from pydrake.geometry import (
    Box,
    Capsule,
    Cylinder,
    Ellipsoid,
    GeometryInstance,
    ProximityProperties,
    SceneGraph,
    Sphere,
)
from pydrake.math import RigidTransform, RollPitchYaw
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder

from drake_starnav.lidar import LidarParameters
from drake_starnav.systems.lidar_sensor import LidarSensor

SHAPES = {
    "box": (Box(1.0, 0.5, 1.0), RigidTransform(RollPitchYaw(0.0, 0.0, 0.4), [2.5, 0.0, 0.5])),
    "tipped cylinder": (Cylinder(0.2, 1.5), RigidTransform(RollPitchYaw(0.6, 0.0, 0.0), [0.0, 2.0, 0.3])),
    "sphere": (Sphere(0.5), RigidTransform([-2.0, 0.0, 0.4])),
    "capsule": (Capsule(0.2, 1.0), RigidTransform(RollPitchYaw(np.pi / 2, 0.0, 0.0), [0.0, -2.0, 0.3])),
    "ellipsoid": (Ellipsoid(0.8, 0.3, 0.6), RigidTransform(RollPitchYaw(0.0, 0.0, 0.8), [2.0, -2.0, 0.3])),
}


def main() -> None:
    """Build the scene, take one scan, print what each beam sector saw."""
    builder = DiagramBuilder()
    scene_graph = builder.AddSystem(SceneGraph())
    source = scene_graph.RegisterSource("example")
    for name, (shape, X_WG) in SHAPES.items():
        geometry = scene_graph.RegisterAnchoredGeometry(source, GeometryInstance(X_WG, shape, name))
        scene_graph.AssignRole(source, geometry, ProximityProperties())
    lidar = builder.AddSystem(
        LidarSensor(
            LidarParameters(), parent_frame_id=scene_graph.world_frame_id(), X_PS=RigidTransform([0.0, 0.0, 0.3])
        )
    )
    builder.Connect(scene_graph.get_query_output_port(), lidar.GetInputPort("geometry_query"))
    simulator = Simulator(builder.Build())
    simulator.Initialize()

    scan = lidar.GetOutputPort("scan").Eval(lidar.GetMyContextFromRoot(simulator.get_context()))
    print(f"{len(scan.ranges)} beams, {scan.hits.sum()} hits, nearest {scan.distances.min():.2f} m")
    edges = np.flatnonzero(np.diff(scan.hits.astype(int))) + 1
    for beams in np.split(np.arange(len(scan.ranges)), edges):
        if scan.hits[beams[0]]:
            first, last = np.degrees(scan.bearings[beams[[0, -1]]])
            print(f"{first:6.0f} to {last:4.0f} deg: nearest {scan.distances[beams].min():.2f} m")


if __name__ == "__main__":
    main()
