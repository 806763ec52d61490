"""Moving obstacles as bodies of a MultibodyPlant that are exactly where their paths say.

Each slides on two prismatic joints, and forces at these bring it to its place at the end of each step of the plant:
m ((p(t + h) - q)/h - v)/h, from the position q and velocity v at the step's beginning. The plant integrates them
exactly, as nothing else moves the bodies, and its contact solver does not include them. In contact with a robot they
push, as heavy as they are, and what a robot holds them up is made good in the next step.
"""

import numpy as np
from pydrake.geometry import CollisionFilterDeclaration, Cylinder, GeometryId, GeometrySet, Role, SceneGraph
from pydrake.math import RigidTransform
from pydrake.multibody.plant import CoulombFriction, MultibodyPlant
from pydrake.multibody.tree import ModelInstanceIndex, PrismaticJoint, SpatialInertia
from pydrake.systems.framework import Context, DiagramBuilder, LeafSystem

from drake_starnav.station.world_geometry import find_obstacle_height
from drake_starnav.systems.release import declare_vector
from drake_starnav.worlds.moving_obstacles import MOVING_OBSTACLE_COLOR, MovingObstacles, moving_obstacle_states

MOVING_OBSTACLES = "moving_obstacles"
"""Name of the model instance of all moving obstacles of a plant."""
MOVING_OBSTACLE_MASS = 200.0
"""Much more than a robot's, kg."""
_AXES = {"x": np.array([1.0, 0.0, 0.0]), "y": np.array([0.0, 1.0, 0.0])}


def add_moving_obstacles(
    plant: MultibodyPlant, scene_graph: SceneGraph, moving_obstacles: MovingObstacles, robot: ModelInstanceIndex
) -> None:
    """Add moving obstacles, at their first way points, to a plant not yet finalized, after all that stands.

    They collide with the robot's model alone.
    """
    if not len(moving_obstacles):
        return
    inspector = scene_graph.model_inspector()
    others = set(inspector.GetAllGeometryIds(Role.kProximity))
    height = find_obstacle_height(plant, scene_graph)
    model = plant.AddModelInstance(MOVING_OBSTACLES)
    start_places, _ = moving_obstacle_states(moving_obstacles, np.zeros(1))
    for k, (radius, start) in enumerate(zip(moving_obstacles.radii, start_places[0], strict=True)):
        _add_cylinder(plant, model, f"moving_obstacle_{k}", Cylinder(radius, height), start)
    moving = GeometrySet(list(set(inspector.GetAllGeometryIds(Role.kProximity)) - others))
    for index in plant.GetBodyIndices(robot):
        others -= set(inspector.GetGeometries(plant.GetBodyFrameIdOrThrow(index), Role.kProximity))
    declaration = CollisionFilterDeclaration().ExcludeWithin(moving).ExcludeBetween(moving, GeometrySet(list(others)))
    scene_graph.collision_filter_manager().Apply(declaration)


def _add_cylinder(
    plant: MultibodyPlant, model: ModelInstanceIndex, name: str, shape: Cylinder, start: np.ndarray
) -> None:
    """Add an upright cylinder that slides along x and y from a place (2,), m, by a motor for each."""
    mass, X_BG = MOVING_OBSTACLE_MASS, RigidTransform([0.0, 0.0, 0.5 * shape.length()])
    inertia = SpatialInertia.SolidCylinderWithMass(mass, shape.radius(), shape.length(), [0.0, 0.0, 1.0])
    slide_body = plant.AddRigidBody(f"{name}_slide", model, SpatialInertia.Zero())  # along x, without a mass
    body, parent = plant.AddRigidBody(name, model, inertia), plant.world_body()
    for child, (axis, direction), place in zip((slide_body, body), _AXES.items(), start, strict=True):
        frames = parent.body_frame(), child.body_frame()
        joint = plant.AddJoint(PrismaticJoint(f"{name}_{axis}", *frames, direction))
        joint.set_default_translation(place)
        plant.AddJointActuator(f"{name}_{axis}", joint)
        parent = child
    plant.RegisterCollisionGeometry(body, X_BG, shape, name, CoulombFriction(0.3, 0.3))
    plant.RegisterVisualGeometry(body, X_BG, shape, f"{name}_visual", [*MOVING_OBSTACLE_COLOR, 1.0])


def add_moving_obstacle_drive(
    builder: DiagramBuilder, plant: MultibodyPlant, moving_obstacles: MovingObstacles
) -> list[GeometryId]:
    """Let what `add_moving_obstacles` added follow its paths, once the plant is finalized; returns the collision
    geometries."""
    if not len(moving_obstacles):
        return []
    model = plant.GetModelInstanceByName(MOVING_OBSTACLES)
    drive = builder.AddNamedSystem(
        "moving_obstacle_drive", MovingObstacleDrive(moving_obstacles, time_step=plant.time_step())
    )
    builder.Connect(plant.get_state_output_port(model), drive.GetInputPort("state"))
    builder.Connect(drive.GetOutputPort("forces"), plant.get_actuation_input_port(model))
    bodies = (plant.get_body(index) for index in plant.GetBodyIndices(model))
    return [geometry for body in bodies for geometry in plant.GetCollisionGeometriesForBody(body)]


class MovingObstacleDrive(LeafSystem):
    """Applies the forces that move obstacles along their paths.

    ```
              ┌─────────────────────┐
    state ───>│ MovingObstacleDrive ├──> forces
              └─────────────────────┘
    ```

    Ports:
        state: vector of the moving obstacles' model: x and y of each, m, then their rates, m/s.
        forces: vector, along x and y on each, N, for the actuation of the moving obstacles' model.
    """

    def __init__(self, moving_obstacles: MovingObstacles, *, time_step: float) -> None:
        """Move the obstacles given to `add_moving_obstacles`, in a plant of that time step, s."""
        super().__init__()
        self._moving_obstacles, self._time_step = moving_obstacles, time_step
        self._size = 2 * len(moving_obstacles)
        self._state = self.DeclareVectorInputPort("state", 2 * self._size)
        declare_vector(self, "forces", self._size, MovingObstacleDrive._compute_forces)

    def _compute_forces(self, context: Context) -> np.ndarray:
        q, v = self._state.Eval(context).reshape(2, self._size)
        h = self._time_step
        next_places, _ = moving_obstacle_states(self._moving_obstacles, np.array([context.get_time() + h]))
        return MOVING_OBSTACLE_MASS * ((next_places.ravel() - q) / h - v) / h
