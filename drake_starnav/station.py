"""The robot in its world, as one diagram with dotted ports."""

import math
import xml.etree.ElementTree as ElementTree
from pathlib import Path

from pydrake.geometry import GeometryId, Role, SceneGraph
from pydrake.math import RigidTransform, RollPitchYaw, RotationMatrix
from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import AddMultibodyPlant, MultibodyPlant, MultibodyPlantConfig
from pydrake.multibody.tree import ModelInstanceIndex, PdControllerGains
from pydrake.systems.framework import Diagram, DiagramBuilder
from pydrake.systems.primitives import DiscreteTimeDelay

from drake_starnav.errors import StarnavError
from drake_starnav.faults import DriveParameters, LocalizationParameters
from drake_starnav.lidar import LidarParameters
from drake_starnav.models import model_path
from drake_starnav.robot import RobotParameters
from drake_starnav.systems.lidar_sensor import LidarSensor
from drake_starnav.systems.model_world import add_model, drop_half_spaces, floor_geometries
from drake_starnav.systems.mover_bodies import add_mover_drive, add_movers
from drake_starnav.systems.planar_localization import PlanarLocalization
from drake_starnav.systems.wheel_slip import WheelSlip
from drake_starnav.systems.wheel_speed_command import WheelSpeedCommand
from drake_starnav.systems.world_geometry import add_ground, add_world
from drake_starnav.worlds.world import World

WHEELS = ("left_wheel", "right_wheel")
"""Names of the joints, links and actuators that a robot model must have besides `base_link` and frame `lidar`."""
DRAKE_NAMESPACE = "http://drake.mit.edu"
HULL = "hull"
"""Geometries of the shipped robots whose name begins so get the radius of `robot.radius`; wheels stay inside it."""
WHEEL_GAIN = 10.0
"""Velocity servo of the wheels, N m s/rad."""
LIDAR_TOLERANCE = 1e-3
"""Of where a model's lidar is, m and rad: poses of the robot are taken for those of its sensor."""
LIDAR_PORTS = ("scan", "ranges", "point_cloud", "X_WS")
POSE_PORTS = ("pose", "state", "scan_pose")


class RobotEquipment(Diagram):
    """What makes a model of a plant a robot: its lidar, its localization and its wheel servo, as one diagram.

    ```
                           ┌────────────────┐
    geometry_query ───────>│                ├──> lidar.scan, lidar.ranges, lidar.point_cloud, lidar.X_WS
    multibody_state ──────>│ RobotEquipment ├──> localization.pose, localization.state, localization.scan_pose
    drive.twist_command ──>│                ├──> desired_state
                           └────────────────┘
    ```

    Ports:
        geometry_query: abstract, `QueryObject` of the scene.
        multibody_state: vector of the robot's model, from the plant.
        drive.twist_command, lidar.*, localization.*: as of `NavigationStation`.
        desired_state: vector of the robot's model, to the plant.

    The lidar sees other robots in the plant, where they reach into its plane, and not its own.
    """

    def __init__(
        self,
        plant: MultibodyPlant,
        scene_graph: SceneGraph,
        model: ModelInstanceIndex,
        lidar: LidarParameters,
        *,
        localization: LocalizationParameters | None = None,
        drive: DriveParameters | None = None,
        time_step: float = 0.005,
        seed: int = 0,
    ) -> None:
        """
        Args:
            plant: finalized.
            scene_graph: of the plant.
            model: the robot, as from `add_robot`.
            lidar: the sensor.
            localization: error of the pose; none by default.
            drive: delay and slip of the wheels; none by default.
            time_step: of the plant, s.
            seed: of the faults and the sensor's noise.
        """
        super().__init__()
        drive = drive or DriveParameters()
        builder = DiagramBuilder()
        inspector = scene_graph.model_inspector()
        frames = [plant.GetBodyFrameIdOrThrow(index) for index in plant.GetBodyIndices(model)]
        self.robot_geometries = [g for f in frames for g in inspector.GetGeometries(f, Role.kProximity)]
        sensor = builder.AddNamedSystem(
            "lidar",
            LidarSensor(
                lidar,
                parent_frame_id=plant.GetBodyFrameIdOrThrow(plant.GetBodyByName("base_link", model).index()),
                X_PS=plant.GetFrameByName("lidar", model).GetFixedPoseInBodyFrame(),
                exclude_frames=frames,
                seed=seed,
            ),
        )
        where = builder.AddNamedSystem(
            "localization",
            PlanarLocalization(
                num_positions=plant.num_positions(model),
                num_velocities=plant.num_velocities(model),
                lidar=lidar,
                error=localization,
                seed=seed,
            ),
        )
        wheels = builder.AddNamedSystem("wheels", WheelSpeedCommand(**drive_geometry(plant, scene_graph, model)))
        builder.ExportInput(sensor.GetInputPort("geometry_query"), "geometry_query")
        turning, command = wheels.GetOutputPort("desired_state"), wheels.GetInputPort("twist_command")
        if drive.slip > 0.0:
            slipping = builder.AddNamedSystem("wheel_slip", WheelSlip(slip=drive.slip, seed=seed))
            builder.Connect(turning, slipping.get_input_port())
            turning = slipping.get_output_port()
        if drive.delay > 0.0:
            late = builder.AddNamedSystem("drive_delay", DiscreteTimeDelay(time_step, delay_steps(drive, time_step), 2))
            builder.Connect(late.get_output_port(), command)
            command = late.get_input_port()
        builder.ExportInput(where.GetInputPort("multibody_state"), "multibody_state")
        builder.ExportInput(command, "drive.twist_command")
        for name in LIDAR_PORTS:
            builder.ExportOutput(sensor.GetOutputPort(name), f"lidar.{name}")
        for name in POSE_PORTS:
            builder.ExportOutput(where.GetOutputPort(name), f"localization.{name}")
        builder.ExportOutput(turning, "desired_state")
        builder.BuildInto(self)


class NavigationStation(Diagram):
    """A differential-drive robot with a lidar in a world: plant, scene, sensor and wheel servo in one diagram.

    ```
                           ┌───────────────────┐
                           │                   ├──> lidar.scan, lidar.ranges, lidar.point_cloud, lidar.X_WS
                           │                   ├──> localization.pose, localization.state
    drive.twist_command ──>│ NavigationStation ├──> localization.scan_pose
                           │                   ├──> cheat.robot_state, cheat.contact_results
                           │                   ├──> cheat.geometry_query
                           └───────────────────┘
    ```

    Ports:
        drive.twist_command: vector (v, omega), m/s and rad/s.
        lidar.*: as of `LidarSensor`; the sensor frame S lies on the robot's axis.
        localization.pose: vector (x, y, yaw) of the robot's base in the world frame W, m and rad, with its
            declared error.
        localization.state: vector (x, y, yaw, v, omega).
        localization.scan_pose: the pose at the time of the scan that arrived last.
        cheat.robot_state: multibody state of the robot.
        cheat.contact_results: `ContactResults` of the plant.
        cheat.geometry_query: `QueryObject` of the scene.
    """

    def __init__(
        self,
        world: World,
        robot: RobotParameters,
        lidar: LidarParameters,
        *,
        localization: LocalizationParameters | None = None,
        drive: DriveParameters | None = None,
        time_step: float = 0.005,
        seed: int = 0,
    ) -> None:
        """
        Args:
            world: obstacles, and where the robot starts.
            robot: model and size.
            lidar: the sensor.
            localization: error of the believed pose; none by default.
            drive: faults of the drive; none by default.
            time_step: of the plant, s.
            seed: of the sensor's noise and of the faults.
        """
        super().__init__()
        builder = DiagramBuilder()
        plant, scene_graph, self.robot_model, self.ground = add_plant(builder, world, robot, time_step)
        self.plant: MultibodyPlant = plant
        self.scene_graph: SceneGraph = scene_graph
        self.floor = [self.ground] if world.model is None else floor_geometries(plant, scene_graph)
        equipment = builder.AddNamedSystem(
            "robot",
            RobotEquipment(
                plant,
                scene_graph,
                self.robot_model,
                lidar,
                localization=localization,
                drive=drive,
                time_step=time_step,
                seed=seed,
            ),
        )
        self.robot_geometries = equipment.robot_geometries
        self.mover_geometries = add_mover_drive(builder, plant, world.movers)
        robot_state = plant.get_state_output_port(self.robot_model)
        builder.Connect(scene_graph.get_query_output_port(), equipment.GetInputPort("geometry_query"))
        builder.Connect(robot_state, equipment.GetInputPort("multibody_state"))
        builder.Connect(equipment.GetOutputPort("desired_state"), plant.get_desired_state_input_port(self.robot_model))
        builder.ExportInput(equipment.GetInputPort("drive.twist_command"), "drive.twist_command")
        for name in (*(f"lidar.{port}" for port in LIDAR_PORTS), *(f"localization.{port}" for port in POSE_PORTS)):
            builder.ExportOutput(equipment.GetOutputPort(name), name)
        builder.ExportOutput(robot_state, "cheat.robot_state")
        builder.ExportOutput(plant.get_contact_results_output_port(), "cheat.contact_results")
        builder.ExportOutput(scene_graph.get_query_output_port(), "cheat.geometry_query")
        builder.BuildInto(self)
        self.set_name("station")

    def release_geometries(self) -> None:
        """Take all geometries out of the scene graph, of which no new context is to be made.

        Drake 1.51 never frees a diagram with systems of Python in it, and what its scene graph notes of each pair of
        geometries may be gigabytes.
        """
        source = self.plant.get_source_id()
        for geometry in self.scene_graph.model_inspector().GetAllGeometryIds():
            self.scene_graph.RemoveGeometry(source, geometry)


def delay_steps(drive: DriveParameters, time_step: float) -> int:
    """The drive's delay in steps of the plant, rounded up."""
    return math.ceil(drive.delay / time_step - 1e-9)


def add_plant(
    builder: DiagramBuilder, world: World, robot: RobotParameters, time_step: float
) -> tuple[MultibodyPlant, SceneGraph, ModelInstanceIndex, GeometryId]:
    """Add a plant and scene graph with the robot, the ground and the obstacles of a world; the plant is finalized.

    Returns:
        plant, scene graph, the robot's model instance, and the ground's geometry.
    """
    plant, scene_graph = AddMultibodyPlant(plant_config(time_step), builder)
    model = add_robot(plant, scene_graph, robot, world.start)
    ground = add_ground(plant, world.extent)
    if world.model is None:
        add_world(plant, world)
    else:
        add_model(plant, scene_graph, world.model)
    add_movers(plant, scene_graph, world.movers, model)
    plant.Finalize()
    if world.model is not None:
        drop_half_spaces(plant, scene_graph)
    return plant, scene_graph, model, ground


def plant_config(time_step: float) -> MultibodyPlantConfig:
    """How a plant is to be simulated so that the robots drive as they are told; `time_step` in s."""
    return MultibodyPlantConfig(
        time_step=time_step,
        contact_model="point",
        discrete_contact_approximation="lagged",
        use_sampled_output_ports=False,  # sampling makes each step an unrestricted update, which copies all state
    )


def robot_urdf(robot: RobotParameters) -> tuple[str, str | None]:
    """The robot's model file; its text too where that differs from the file's.

    The hull of a shipped robot gets the radius `robot.radius`; the base's mass and inertia grow by `robot.mass_error`.
    """
    path = model_path("robots", f"{robot.model}.urdf")
    shipped = path.is_file()
    if not shipped:
        path = Path(robot.model)
        if path.suffix != ".urdf" or not path.is_file():
            names = ", ".join(sorted(p.stem for p in model_path("robots").glob("*.urdf")))
            raise StarnavError(f"robot.model is {robot.model!r}; allowed: {names}, or the path of a .urdf file")
        if robot.mass_error == 0.0:
            return str(path), None
    ElementTree.register_namespace("drake", DRAKE_NAMESPACE)  # Drake reads the prefix, not the namespace
    root = ElementTree.fromstring(path.read_text(encoding="utf-8"))
    for mesh in root.iter("mesh"):
        name = mesh.get("filename", "")
        if "://" not in name:  # relative to the file, which is unknown once its text is parsed
            mesh.set("filename", f"file://{(path.parent / name).resolve()}")
    if shipped:
        for element in (*root.iter("collision"), *root.iter("visual")):
            cylinder = element.find("geometry/cylinder")
            if element.get("name", "").startswith(HULL) and cylinder is not None:
                cylinder.set("radius", repr(robot.radius))
        _pull_in(root, robot.radius)
    inertial = root.find("link[@name='base_link']/inertial")
    if robot.mass_error != 0.0 and inertial is not None:
        for element in (*inertial.iter("mass"), *inertial.iter("inertia")):
            for key, value in element.attrib.items():
                element.set(key, repr(float(value) * (1.0 + robot.mass_error)))
    text = ElementTree.tostring(root, encoding="unicode")
    return str(path), text


def _pull_in(root: ElementTree.Element, radius: float) -> None:
    """Move wheels and casters towards the axis where they would reach out of a hull of this radius."""
    joints = {joint.find("child").get("link"): joint for joint in root.findall("joint")}  # type: ignore[union-attr]
    for link in root.iter("link"):
        for element in (*link.iter("collision"), *link.iter("visual")):
            sphere = element.find("geometry/sphere")
            moved = joints.get(link.get("name"), element)
            origin = moved.find("origin")
            if sphere is None or origin is None:
                continue
            x, y, z = (float(value) for value in origin.get("xyz", "0 0 0").split())
            far = radius - float(sphere.get("radius", "0"))
            if far <= 0.0:
                raise StarnavError(
                    f"robot.radius is {radius:g}; allowed: more than the model's wheels have, {radius - far:g} m"
                )
            share = min(1.0, far / max(math.hypot(x, y), 1e-9))
            origin.set("xyz", f"{x * share!r} {y * share!r} {z!r}")


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
        name: set before the model's own, to tell several robots apart.

    Raises:
        StarnavError: there is no such model, Drake cannot read it, or it lacks what a robot must have.
    """
    path, text = robot_urdf(robot)
    parser = Parser(plant, model_name_prefix=name)
    try:
        # a file of the user's is read where it lies, for the sake of the meshes that it names
        (model,) = parser.AddModels(path) if text is None else parser.AddModelsFromString(text, "urdf")
    except (RuntimeError, ValueError) as error:
        raise StarnavError(
            f"robot model {path} cannot be read: {' '.join(str(error).split())}; allowed: a URDF file with one robot"
        ) from None
    _check_robot(plant, scene_graph, model, path)
    for wheel in WHEELS:
        plant.GetJointActuatorByName(wheel, model).set_controller_gains(PdControllerGains(p=0.0, d=WHEEL_GAIN))
    base = plant.GetBodyByName("base_link", model)
    axle = plant.GetJointByName(WHEELS[0], model).frame_on_parent().GetFixedPoseInBodyFrame().translation()
    height = _wheel_radius(plant, scene_graph, model) - axle[2]
    X_WB = RigidTransform(RotationMatrix.MakeZRotation(start[2]), [start[0], start[1], height])
    plant.SetDefaultFloatingBaseBodyPose(base, X_WB)
    return model


def _check_robot(plant: MultibodyPlant, scene_graph: SceneGraph, model: ModelInstanceIndex, path: str) -> None:
    """Raise a `StarnavError` that names the first thing that the model of a file lacks."""
    for kind, names, has in (
        ("link", ("base_link",), plant.HasBodyNamed),
        ("frame", ("lidar",), plant.HasFrameNamed),
        ("joint", WHEELS, plant.HasJointNamed),
        ("actuator", WHEELS, plant.HasJointActuatorNamed),
    ):
        for name in names:
            if not has(name, model):
                raise StarnavError(f"robot model {path} has no {kind} {name}; allowed: {kind} {', '.join(names)}")
    X_BL = plant.GetFrameByName("lidar", model).GetFixedPoseInBodyFrame()
    x, y, _ = X_BL.translation()
    if math.hypot(x, y) > LIDAR_TOLERANCE or not X_BL.rotation().IsNearlyIdentity(LIDAR_TOLERANCE):
        roll, pitch, yaw = RollPitchYaw(X_BL.rotation()).vector()
        raise StarnavError(
            f"robot model {path}: frame lidar lies at x {x:g}, y {y:g} m of base_link, turned by roll {roll:g}, pitch "
            f"{pitch:g}, yaw {yaw:g} rad; allowed: on its z axis, unturned (lidar.angle_min says where beams begin)"
        )
    inspector = scene_graph.model_inspector()
    for name in WHEELS:
        wheel = plant.GetJointByName(name, model).child_body()
        shapes = [type(inspector.GetShape(g)).__name__ for g in plant.GetCollisionGeometriesForBody(wheel)]
        if shapes != ["Sphere"]:
            raise StarnavError(
                f"robot model {path}: link {wheel.name()} collides as {', '.join(shapes) or 'nothing'}; "
                "allowed: one Sphere, of the wheel's radius"
            )


def _wheel_radius(plant: MultibodyPlant, scene_graph: SceneGraph, model: ModelInstanceIndex) -> float:
    """Radius of the left wheel's collision sphere, m."""
    (geometry,) = plant.GetCollisionGeometriesForBody(plant.GetJointByName(WHEELS[0], model).child_body())
    return scene_graph.model_inspector().GetShape(geometry).radius()


def drive_geometry(plant: MultibodyPlant, scene_graph: SceneGraph, model: ModelInstanceIndex) -> dict[str, float]:
    """Wheel radius and track as the model has them, m."""
    left, right = (
        plant.GetJointByName(name, model).frame_on_parent().GetFixedPoseInBodyFrame().translation() for name in WHEELS
    )
    return {
        "wheel_radius": _wheel_radius(plant, scene_graph, model),
        "track": math.hypot(left[0] - right[0], left[1] - right[1]),
    }
