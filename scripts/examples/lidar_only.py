"""The lidar alone in a manipulation scene: on a swinging boom, tilted down at a table and what stands on it.

Nothing else of the package is used. The table, block, cylinder and bin come with Drake. For each scan the example says
what the beams hit, by asking Drake which shape each point of the cloud lies on, and how far off it the points are.

Run: python scripts/examples/lidar_only.py [--png FILE]
"""

import argparse
from collections import Counter
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from pydrake.geometry import Box
from pydrake.math import RigidTransform, RollPitchYaw
from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import AddMultibodyPlantSceneGraph, CoulombFriction, MultibodyPlant
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder

from drake_starnav import LidarMount, LidarParameters, LidarSensor

MODELS = "package://drake/examples/kuka_iiwa_arm/models"
FREE = {
    "block": ("block_for_pick_and_place.urdf", (-0.05, -0.15, 0.866)),
    "cylinder": ("simple_cylinder.urdf", (0.0, 0.15, 0.831)),
    "bin": ("open_top_box.urdf", (1.1, -1.2, 0.012)),
}
"""Free bodies by name: file, and where they start, m."""
ARM = """
<robot name="arm">
  <link name="column">
    <collision>
      <origin xyz="0 0 0.55"/>
      <geometry><cylinder radius="0.06" length="1.1"/></geometry>
    </collision>
  </link>
  <link name="boom">
    <inertial><mass value="2"/><inertia ixx="0.01" ixy="0" ixz="0" iyy="0.05" iyz="0" izz="0.05"/></inertial>
    <collision>
      <origin xyz="0.15 0 0.05" rpy="0 1.5707963 0"/>
      <geometry><capsule xmlns="http://drake.mit.edu" radius="0.04" length="0.25"/></geometry>
    </collision>
  </link>
  <joint name="shoulder" type="continuous">
    <parent link="column"/><child link="boom"/><origin xyz="0 0 1.1"/><axis xyz="0 0 1"/>
  </joint>
</robot>
"""
X_WArm = RigidTransform([-0.65, 0.0, 0.0])
X_BoomS = RigidTransform(RollPitchYaw(0.0, np.radians(35.0), 0.0), [0.32, 0.0, 0.05])  # tilted down
SPEED = 0.8  # of the shoulder, rad/s


def add_scene(plant: MultibodyPlant) -> None:
    """Ground, a table at the world's origin, objects, and the arm."""
    X_WGround = RigidTransform([0.0, 0.0, -0.5])
    friction = CoulombFriction(0.9, 0.8)
    plant.RegisterCollisionGeometry(plant.world_body(), X_WGround, Box(6.0, 6.0, 1.0), "ground", friction)
    parser = Parser(plant)
    parser.AddModels(url=f"{MODELS}/table/extra_heavy_duty_table.sdf")
    for name, (file, _) in FREE.items():
        (model,) = parser.AddModels(url=f"{MODELS}/objects/{file}")
        plant.RenameModelInstance(model, name)
    parser.AddModelsFromString(ARM, "urdf")
    plant.WeldFrames(plant.world_frame(), plant.GetFrameByName("column"), X_WArm)
    plant.GetJointByName("shoulder").set_default_angle(-0.4)


def main(png: Path | None) -> None:
    """Build the scene, let the boom swing, print what each of a few scans hit."""
    builder = DiagramBuilder()
    plant, scene_graph = AddMultibodyPlantSceneGraph(builder, time_step=0.002)
    add_scene(plant)
    plant.Finalize()
    boom, column = (plant.GetBodyFrameIdOrThrow(plant.GetBodyByName(name).index()) for name in ("boom", "column"))
    lidar = builder.AddSystem(
        LidarSensor(
            LidarParameters(beams=720, range_max=4.0, noise=0.0),
            LidarMount(boom, X_BoomS, exclude_frames=[column]),
            point_cloud_frame="W",
        )
    )
    builder.Connect(scene_graph.get_query_output_port(), lidar.GetInputPort("geometry_query"))
    diagram = builder.Build()

    root = diagram.CreateDefaultContext()
    inside = plant.GetMyContextFromRoot(root)
    for name, (_, p_WB) in FREE.items():
        body = plant.get_body(plant.GetBodyIndices(plant.GetModelInstanceByName(name))[0])
        plant.SetFreeBodyPose(inside, body, RigidTransform(p_WB))
    plant.GetJointByName("shoulder").set_angular_rate(inside, SPEED)

    simulator = Simulator(diagram, root)
    query_port = scene_graph.get_query_output_port()
    clouds: dict[str, list[np.ndarray]] = {}
    for time in (0.25, 0.5, 0.75, 1.0, 1.25):
        simulator.AdvanceTo(time)
        scene = root.Clone()  # as the scan finds it
        simulator.AdvanceTo(time + 1e-3)  # just after the scan
        seen = lidar.GetMyContextFromRoot(root)
        points = lidar.GetOutputPort("point_cloud").Eval(seen).xyzs().astype(float)
        query = query_port.Eval(scene_graph.GetMyContextFromRoot(scene))
        hits, off = Counter[str](), 0.0
        for p_WQ in points.T:
            nearest = min(query.ComputeSignedDistanceToPoint(p_WQ, 0.01), key=lambda found: abs(found.distance))
            body = plant.GetBodyFromFrameId(query.inspector().GetFrameId(nearest.id_G))
            model = plant.GetModelInstanceName(body.model_instance())
            name = "ground" if body.index() == plant.world_body().index() else model
            hits[name] += 1
            clouds.setdefault(name, []).append(p_WQ)
            off = max(off, abs(nearest.distance))
        shares = ", ".join(f"{name} {count}" for name, count in sorted(hits.items()))
        print(f"{time:.2f} s: {points.shape[1]} hits: {shares}; at most {1e6 * off:.1f} um off a surface")
    if png is not None:
        figure = Figure(figsize=(6.0, 6.6), layout="constrained")
        axis = figure.add_subplot()
        for name, cloud in sorted(clouds.items()):
            axis.plot(*np.array(cloud)[:, :2].T, ".", markersize=4.0, label=name)
        axis.set(xlabel="x in m", ylabel="y in m", title="What the beams of five scans hit, from above")
        axis.set(xlim=(-0.4, 1.6), ylim=(-1.7, 0.6), aspect="equal")
        figure.legend(loc="outside lower center", ncols=3, frameon=False, markerscale=3.0)
        png.parent.mkdir(parents=True, exist_ok=True)
        figure.savefig(png, dpi=80)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--png", type=Path, metavar="FILE", help="also draw what happened")
    main(parser.parse_args().png)
