"""Robots as models of a plant: read, checked, and put on the floor."""

from pydrake.geometry import (
    CollisionFilterDeclaration,
    GeometrySet,
    ProximityProperties,
    RoleAssign,
    SceneGraph,
    Sphere,
)
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import CoulombFriction, MultibodyPlant
from pydrake.multibody.tree import ModelInstanceIndex, PdControllerGains

from drake_starnav.errors import StarnavError
from drake_starnav.robot import RobotParameters
from drake_starnav.station.parser_warnings import none_skipped
from drake_starnav.station.robot_checks import check_robot
from drake_starnav.station.robot_file import WHEELS, robot_urdf
from drake_starnav.station.robot_geometry import axles, link_poses, wheel_radii

WHEEL_GAIN = 10.0
"""Velocity servo of the wheels, N m s/rad."""
CASTER_CLEARANCE = 0.005
"""A sphere this near to the floor, or nearer, is a caster, m."""


def add_robot(
    plant: MultibodyPlant,
    scene_graph: SceneGraph,
    robot: RobotParameters,
    start: tuple[float, float, float],
    *,
    name: str = "",
) -> ModelInstanceIndex:
    """Add a robot, standing on the floor z = 0, to a plant not yet finalized.

    Args:
        plant: whose robots they are; see `plant_config`.
        scene_graph: of the plant.
        robot: its model and size.
        start: (x, y, yaw), m and rad, W.
        name: prefix of the model's own name, to distinguish several robots.

    Raises:
        StarnavError: there is no such model, Drake cannot read it, it lacks what a robot must have, its wheels do not
            turn it about base_link's axis, or it is larger than `robot.radius`.
    """
    path, text = robot_urdf(robot)
    parser = Parser(plant, model_name_prefix=name)
    try:
        with none_skipped(f"robot model {path}"):
            (model,) = parser.AddModelsFromString(text, "urdf")
    except StarnavError:
        raise
    except (RuntimeError, ValueError) as error:
        raise StarnavError(
            f"robot model {path} cannot be read: {' '.join(str(error).split())}; allowed: a URDF file with one robot"
        ) from None
    check_robot(plant, scene_graph, model, robot, path)
    if plant.time_step() > 0.0:  # a continuous plant has the servo outside: `WheelServo`
        for wheel in WHEELS:
            plant.GetJointActuatorByName(wheel, model).set_controller_gains(PdControllerGains(p=0.0, d=WHEEL_GAIN))
    base = plant.GetBodyByName("base_link", model)
    height = wheel_radii(plant, scene_graph, model)[0] - axles(plant, model)[0][2]
    _free_wheels(plant, scene_graph, model)
    _free_casters(plant, scene_graph, model, -height)
    X_WB = RigidTransform(RotationMatrix.MakeZRotation(start[2]), [start[0], start[1], height])
    plant.SetDefaultFloatingBaseBodyPose(base, X_WB)
    return model


def _free_wheels(plant: MultibodyPlant, scene_graph: SceneGraph, model: ModelInstanceIndex) -> None:
    """Let the wheels touch no link of their robot: Drake excepts only the one that their joint hangs on."""
    shapes = {
        index: plant.GetCollisionGeometriesForBody(plant.get_body(index)) for index in plant.GetBodyIndices(model)
    }
    wheels = [g for name in WHEELS for g in shapes[plant.GetJointByName(name, model).child_body().index()]]
    links = [g for geometries in shapes.values() for g in geometries]
    apart = CollisionFilterDeclaration().ExcludeBetween(GeometrySet(wheels), GeometrySet(links))
    scene_graph.collision_filter_manager().Apply(apart)


def _free_casters(plant: MultibodyPlant, scene_graph: SceneGraph, model: ModelInstanceIndex, floor: float) -> None:
    """Take the friction from the spheres that stand on the floor beside the wheels, as a caster's wheel turns freely.

    Args:
        plant, scene_graph, model: the robot's.
        floor: its height in base_link, m.
    """
    inspector = scene_graph.model_inspector()
    wheels = {plant.GetJointByName(name, model).child_body().index() for name in WHEELS}
    for index, X_BL in link_poses(plant, model).items():
        for geometry in () if index in wheels else plant.GetCollisionGeometriesForBody(plant.get_body(index)):
            shape = inspector.GetShape(geometry)
            if not isinstance(shape, Sphere):
                continue
            middle = (X_BL @ inspector.GetPoseInFrame(geometry)).translation()
            if middle[2] - shape.radius() < floor + CASTER_CLEARANCE:
                properties = ProximityProperties(inspector.GetProximityProperties(geometry))
                properties.UpdateProperty("material", "coulomb_friction", CoulombFriction(0.0, 0.0))
                scene_graph.AssignRole(plant.get_source_id(), geometry, properties, RoleAssign.kReplace)
