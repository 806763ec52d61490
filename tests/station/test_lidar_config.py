"""A lidar is added to a diagram as Drake's cameras are, from a struct that Drake's typed YAML reads and writes."""

import numpy as np
import pytest
from pydrake.common.yaml import yaml_dump_typed, yaml_load_typed
from pydrake.geometry import Box, ProximityProperties, Sphere
from pydrake.math import RigidTransform
from pydrake.multibody.plant import AddMultibodyPlantSceneGraph, CoulombFriction
from pydrake.multibody.tree import SpatialInertia
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder

from drake_starnav.errors import StarnavError
from drake_starnav.lidar.sensor_model import LidarParameters
from drake_starnav.station.lidar_config import ApplyLidarConfig, LidarConfig

TEXT = """
name: front
beams: 4
noise: 0
X_PS:
  base_frame: cart::mast
  translation: [0, 0, 0.5]
  rotation: !Rpy {deg: [0, 0, 90]}
"""


def scene() -> DiagramBuilder:
    """A ball at x = 3 m, and a cart with a mast that carries a plate 1 m ahead, fixed to the world."""
    builder = DiagramBuilder()
    plant, _ = AddMultibodyPlantSceneGraph(builder, 0.0)
    friction = CoulombFriction(0.5, 0.5)
    plant.RegisterCollisionGeometry(plant.world_body(), RigidTransform([3, 0, 0.5]), Sphere(0.5), "ball", friction)
    cart = plant.AddModelInstance("cart")
    base = plant.AddRigidBody("base", cart, SpatialInertia.SolidBoxWithMass(1.0, 1, 1, 1))
    mast = plant.AddRigidBody("mast", cart, SpatialInertia.SolidBoxWithMass(1.0, 1, 1, 1))
    plant.RegisterCollisionGeometry(
        base, RigidTransform([1, 0, 0.5]), Box(0.1, 0.1, 0.1), "plate", ProximityProperties()
    )
    plant.WeldFrames(plant.world_frame(), base.body_frame())
    plant.WeldFrames(base.body_frame(), mast.body_frame())
    plant.Finalize()
    return builder


def ranges(builder: DiagramBuilder, config: LidarConfig) -> np.ndarray:
    lidar = ApplyLidarConfig(config, builder)
    simulator = Simulator(builder.Build())
    simulator.Initialize()
    return lidar.GetOutputPort("ranges").Eval(lidar.GetMyContextFromRoot(simulator.get_context())).copy()


def test_yaml_is_read_and_written() -> None:
    config = yaml_load_typed(schema=LidarConfig, data=TEXT)
    assert (config.name, config.beams, config.X_PS.base_frame) == ("front", 4, "cart::mast")
    text = yaml_dump_typed(config)
    assert yaml_dump_typed(yaml_load_typed(schema=LidarConfig, data=text)) == text
    with pytest.raises(RuntimeError, match="beems"):
        yaml_load_typed(schema=LidarConfig, data="beems: 4")


def test_its_fields_and_defaults_are_those_of_the_parameters() -> None:
    config = LidarConfig()
    for name, value in vars(LidarParameters()).items():
        assert getattr(config, name) == value


def test_the_lidar_is_named_placed_and_connected() -> None:
    builder = scene()
    measured = ranges(builder, yaml_load_typed(schema=LidarConfig, data=TEXT))
    # beams at -pi, -pi/2, 0 and pi/2 about z of S, which is turned by 90 degrees
    assert measured == pytest.approx([np.inf, 2.5, np.inf, np.inf])


def test_the_model_that_carries_it_is_seen_on_request() -> None:
    config = yaml_load_typed(schema=LidarConfig, data=TEXT + "sees_parent_model: true\n")
    assert ranges(scene(), config)[1] == pytest.approx(0.95)


def test_without_a_base_frame_it_stands_in_the_world() -> None:
    config = LidarConfig(beams=4, noise=0.0)
    config.X_PS.translation = [0.0, 0.0, 0.5]
    builder = scene()
    assert ranges(builder, config) == pytest.approx([np.inf, np.inf, 0.95, np.inf])


@pytest.mark.parametrize(
    "change, words",
    [
        ({"beams": 0}, "lidar.beams is 0; allowed: 3 <= x"),
        ({"range_max": -1.0}, "lidar.range_max is -1"),
        ({"base": "cart::nose"}, "lidar front: X_PS cannot be used: .*nose.*allowed: a frame of the plant"),
        ({"base": "boat::mast"}, "lidar front: X_PS cannot be used: .*boat"),
    ],
)
def test_what_is_wrong_is_said(change: dict, words: str) -> None:
    config = yaml_load_typed(schema=LidarConfig, data=TEXT)
    config.X_PS.base_frame = change.pop("base", config.X_PS.base_frame)
    for name, value in change.items():
        setattr(config, name, value)
    with pytest.raises(StarnavError, match=words):
        ApplyLidarConfig(config, scene())


def test_two_need_two_names_and_a_plant() -> None:
    builder = scene()
    ApplyLidarConfig(LidarConfig(), builder)
    assert builder.HasSubsystemNamed("lidar_sensor_preview_lidar")
    with pytest.raises(StarnavError, match="a lidar named preview_lidar already"):
        ApplyLidarConfig(LidarConfig(), builder)
    with pytest.raises(StarnavError, match="no system named plant"):
        ApplyLidarConfig(LidarConfig(), DiagramBuilder())
