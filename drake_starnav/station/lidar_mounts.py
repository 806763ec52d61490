"""Where robots carry their lidars, collars by which these see other robots, and a lidar anywhere from a struct."""

import dataclasses
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from pydrake.common.schema import Transform
from pydrake.geometry import Cylinder, GeometryId, Role, SceneGraph
from pydrake.math import RigidTransform, RollPitchYaw
from pydrake.multibody.plant import CoulombFriction, MultibodyPlant
from pydrake.multibody.tree import FrameIndex, ModelInstanceIndex, ScopedName
from pydrake.systems.framework import DiagramBuilder

from drake_starnav.errors import StarnavError, said_by
from drake_starnav.lidar.mounts import Mount
from drake_starnav.lidar.sensor_model import LidarParameters
from drake_starnav.parameters import build, plain_struct
from drake_starnav.scenario.schema import Scenario
from drake_starnav.station.lidar_sensor import LidarMount, LidarSensor
from drake_starnav.station.robot_geometry import TOLERANCE, RobotModel
from drake_starnav.station.world_geometry import make_upright_prism

ALIKE = ("lidar", "laser", "scan", "hokuyo", "velodyne", "rplidar", "ouster", "sick", "lds")
"""Parts of the names that lidars' frames have."""
_Parameters: Any = plain_struct(LidarParameters)
MOST_TILT = math.radians(2.0)
"""Tilt up to which a lidar's scans are taken for those of a level one, rad; `error_budget` has what that costs."""
COLLAR = 0.03
"""How far a collar reaches above and below the planes of all lidars, m."""
COLLAR_NAME = "collar"


def find_lidar_poses(robot: RobotModel, lidars: Sequence[LidarParameters]) -> list[RigidTransform]:
    """The pose of each lidar's frame in base_link, with all joints at zero.

    Raises:
        StarnavError: the model has no such frame, or the frame is not joined to base_link.
    """
    plant, model, link_poses, lidar_poses = robot.plant, robot.index, robot.poses(), []
    for k, lidar in enumerate(lidars):
        if not plant.HasFrameNamed(lidar.frame, model):
            place, frame_names = "lidar" if len(lidars) == 1 else f"lidars[{k}]", ", ".join(_list_lidar_frames(robot))
            raise StarnavError(
                f"{place}.frame is {lidar.frame}; allowed: a link or frame of the robot's model, {frame_names}"
            )
        frame = plant.GetFrameByName(lidar.frame, model)
        X_BL = link_poses.get(frame.body().index())
        if X_BL is None:
            raise StarnavError(f"frame {lidar.frame} is not joined to link base_link; allowed: a joint between them")
        lidar_poses.append(X_BL @ frame.GetFixedPoseInBodyFrame())
    return lidar_poses


def find_mount(X_BS: RigidTransform, lidar: LidarParameters, height: float) -> Mount:
    """The mount of a lidar whose frame S is at a pose in base_link, `height` above the floor, m.

    Raises:
        StarnavError: it is tilted by more than MOST_TILT, or so that it sees the floor.
    """
    upward, (x, y, _) = float(X_BS.rotation().matrix()[2, 2]), X_BS.translation().tolist()
    tilt = math.acos(min(abs(upward), 1.0))
    roll, pitch, yaw = RollPitchYaw(X_BS.rotation()).vector() + 0.0  # no -0
    turned_text = f"frame {lidar.frame} is turned by roll {roll:g}, pitch {pitch:g}, yaw {yaw:g} rad in base_link"
    if tilt > MOST_TILT:
        raise StarnavError(
            f"{turned_text}, {math.degrees(tilt):.3g} degrees from level; allowed: up to {math.degrees(MOST_TILT):g} "
            "degrees, upright or upside down"
        )
    if tilt > TOLERANCE and lidar.range_max * math.sin(tilt) >= height:
        raise StarnavError(
            f"{turned_text}, {math.degrees(tilt):.3g} degrees from level, and {height:.3g} m high: it sees the floor "
            f"from {height / math.sin(tilt):.3g} m on; allowed: a lidar.range_max below that, or less tilt"
        )
    forward_axis = X_BS.rotation().matrix()[:2, 0]
    yaw = math.atan2(forward_axis[1], forward_axis[0])
    if math.hypot(x, y) <= TOLERANCE:
        x = y = 0.0
    return Mount(x, y, yaw if abs(yaw) > TOLERANCE else 0.0, upward < 0.0, tilt if tilt > TOLERANCE else 0.0)


def _list_lidar_frames(robot: RobotModel) -> list[str]:
    """Names of the model's frames that may be lidars'; if there are none, of all but those of joints."""
    frames = (robot.plant.get_frame(FrameIndex(k)) for k in range(robot.plant.num_frames()))
    joint_names = [joint.name() for joint in robot.joints]
    hidden_links = {f"{joint}_{side}" for joint in joint_names for side in ("parent", "child")} | {"", "__model__"}
    frame_names = sorted({frame.name() for frame in frames if frame.model_instance() == robot.index} - hidden_links)
    return [name for name in frame_names if any(part in name.lower() for part in ALIKE)] or frame_names


@dataclass
class LidarConfig(_Parameters):
    """Configuration of a planar lidar, for `ApplyLidarConfig`; `yaml_load_typed` reads it, `yaml_dump_typed` writes it.

    Besides these it has the fields of `LidarParameters`, e.g. `beams`, `range_max` and `rate`. Values are checked when
    it is applied.

    Attributes:
        name: of the sensor; no two in a diagram may have the same.
        X_PS: pose of the sensor frame S in the parent frame P, its `base_frame`: a scoped name as `robot::base_link`;
            without one, the world.
        sees_parent_model: whether the shapes of the model that P belongs to are seen; those of P's body never are.
        seed: of the noise.
    """

    name: str = "preview_lidar"
    X_PS: Transform = dataclasses.field(default_factory=Transform)
    sees_parent_model: bool = False
    seed: int = 0


def ApplyLidarConfig(  # named as Drake's functions of this kind
    config: LidarConfig,
    builder: DiagramBuilder,
    plant: MultibodyPlant | None = None,
    scene_graph: SceneGraph | None = None,
) -> LidarSensor:
    """Add the lidar of a configuration to a diagram, named `lidar_sensor_{config.name}`, and connect it to the scene.

    The plant is finalized and in the builder, as the scene graph is; None for the systems named "plant" and
    "scene_graph". The outputs of the sensor are left to connect.

    Raises:
        StarnavError: a value is not allowed, there is no such frame, plant or scene graph, or a lidar has this name.
    """
    plant, scene_graph = _find_system(builder, plant, "plant"), _find_system(builder, scene_graph, "scene_graph")
    names = {field.name for field in dataclasses.fields(LidarParameters)}
    parameters = build(LidarParameters, {name: getattr(config, name) for name in names}, "lidar")
    name = f"lidar_sensor_{config.name}"
    if builder.HasSubsystemNamed(name):
        raise StarnavError(f"the diagram has a lidar named {config.name} already; allowed: another name")
    sensor = LidarSensor(parameters, _make_mount(config, plant), seed=config.seed)
    builder.AddNamedSystem(name, sensor)
    builder.Connect(scene_graph.get_query_output_port(), sensor.GetInputPort("geometry_query"))
    return sensor


def _find_system(builder: DiagramBuilder, system: Any, name: str) -> Any:
    if system is None:
        if not builder.HasSubsystemNamed(name):
            raise StarnavError(f"the diagram has no system named {name}; allowed: one of that name, or {name}=...")
        return builder.GetSubsystemByName(name)
    return system


def _make_mount(config: LidarConfig, plant: MultibodyPlant) -> LidarMount:
    X_PS, base_name = config.X_PS, config.X_PS.base_frame or "world"
    try:
        frame = ScopedName.Parse(base_name)
        named_model = plant.GetModelInstanceByName(frame.get_namespace()) if frame.get_namespace() else None
        parent_frame = plant.GetFrameByName(frame.get_element(), *(() if named_model is None else (named_model,)))
        X_FS: RigidTransform = X_PS.GetDeterministicValue()
    except RuntimeError as error:
        raise StarnavError(
            f"lidar {config.name}: X_PS cannot be used: {said_by(error)}; allowed: a frame of the plant as base_frame, "
            "and a pose that is not random"
        ) from None
    parent_body, own_bodies = parent_frame.body(), []
    if not config.sees_parent_model and parent_body.index() != plant.world_body().index():
        own_bodies = plant.GetBodyIndices(parent_body.model_instance())
    X_BS, frame_of = parent_frame.GetFixedPoseInBodyFrame() @ X_FS, plant.GetBodyFrameIdOrThrow
    return LidarMount(frame_of(parent_body.index()), X_BS, exclude_frames=list(map(frame_of, own_bodies)))


def add_collars(
    plant: MultibodyPlant, scene_graph: SceneGraph, robots: Sequence[Scenario], models: Sequence[ModelInstanceIndex]
) -> None:
    """Give each robot, in a plant not yet finalized, a collar by which the lidars of the others see it."""
    base_links = [plant.GetBodyByName("base_link", model) for model in models]
    floor_heights = [float(plant.GetDefaultFloatingBaseBodyPose(base).translation()[2]) for base in base_links]
    plane_heights = [
        floor + float(X_BL.translation()[2])
        for each, model, floor in zip(robots, models, floor_heights, strict=True)
        for X_BL in find_lidar_poses(RobotModel(plant, scene_graph, model), each.all_lidars)
    ]
    lowest_height, highest_height = max(min(plane_heights) - COLLAR, 0.01), max(plane_heights) + COLLAR
    for each, base, floor in zip(robots, base_links, floor_heights, strict=True):
        robot, bottom, top = each.robot, lowest_height - floor, highest_height - floor
        X_BC = RigidTransform([0.0, 0.0, 0.5 * (bottom + top)])
        prism_shapes = [make_upright_prism(part, top - bottom, COLLAR_NAME) for part in robot.shape.parts]
        for k, shape in enumerate([Cylinder(robot.radius, top - bottom)] if robot.shape.is_disc else prism_shapes):
            plant.RegisterCollisionGeometry(base, X_BC, shape, f"{COLLAR_NAME}_{k}", CoulombFriction(0.3, 0.3))


def find_collar_geometries(scene_graph: SceneGraph) -> list[GeometryId]:
    """The collars of all robots in a scene."""
    inspector = scene_graph.model_inspector()
    geometries = inspector.GetAllGeometryIds(Role.kProximity)
    return [g for g in geometries if inspector.GetName(g).rpartition("::")[2].rpartition("_")[0] == COLLAR_NAME]
