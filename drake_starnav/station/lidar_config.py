"""A lidar as a plain struct, and what adds it to a diagram: shaped like Drake's `CameraConfig`."""

import dataclasses
from dataclasses import dataclass
from typing import Any

from pydrake.common.schema import Transform
from pydrake.geometry import SceneGraph
from pydrake.math import RigidTransform
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import ScopedName
from pydrake.systems.framework import DiagramBuilder

from drake_starnav.errors import StarnavError, said_by
from drake_starnav.lidar.sensor_model import LidarParameters
from drake_starnav.parameters import build, plain_struct
from drake_starnav.station.lidar_sensor import LidarMount, LidarSensor

_Parameters: Any = plain_struct(LidarParameters)


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
    plant, scene_graph = _found(builder, plant, "plant"), _found(builder, scene_graph, "scene_graph")
    names = {field.name for field in dataclasses.fields(LidarParameters)}
    parameters = build(LidarParameters, {name: getattr(config, name) for name in names}, "lidar")
    name = f"lidar_sensor_{config.name}"
    if builder.HasSubsystemNamed(name):
        raise StarnavError(f"the diagram has a lidar named {config.name} already; allowed: another name")
    sensor = LidarSensor(parameters, _mount(config, plant), seed=config.seed)
    builder.AddNamedSystem(name, sensor)
    builder.Connect(scene_graph.get_query_output_port(), sensor.GetInputPort("geometry_query"))
    return sensor


def _found(builder: DiagramBuilder, system: Any, name: str) -> Any:
    if system is None:
        if not builder.HasSubsystemNamed(name):
            raise StarnavError(f"the diagram has no system named {name}; allowed: one of that name, or {name}=...")
        return builder.GetSubsystemByName(name)
    return system


def _mount(config: LidarConfig, plant: MultibodyPlant) -> LidarMount:
    X_PS, base = config.X_PS, config.X_PS.base_frame or "world"
    try:
        frame = ScopedName.Parse(base)
        inside = plant.GetModelInstanceByName(frame.get_namespace()) if frame.get_namespace() else None
        parent = plant.GetFrameByName(frame.get_element(), *(() if inside is None else (inside,)))
        X_FS: RigidTransform = X_PS.GetDeterministicValue()
    except RuntimeError as error:
        raise StarnavError(
            f"lidar {config.name}: X_PS cannot be used: {said_by(error)}; allowed: a frame of the plant as base_frame, "
            "and a pose that is not random"
        ) from None
    body = parent.body()
    own = (
        []
        if config.sees_parent_model or body.index() == plant.world_body().index()
        else [plant.GetBodyFrameIdOrThrow(index) for index in plant.GetBodyIndices(body.model_instance())]
    )
    X_BS = parent.GetFixedPoseInBodyFrame() @ X_FS
    return LidarMount(plant.GetBodyFrameIdOrThrow(body.index()), X_BS, exclude_frames=own)
