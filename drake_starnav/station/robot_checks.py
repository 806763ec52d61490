"""What a robot's model must have."""

from collections.abc import Iterator

from pydrake.geometry import SceneGraph
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import ModelInstanceIndex

from drake_starnav.station.robot_geometry import (
    collision_shapes,
    floor_contact,
    link_poses,
    lowest,
    massless_links,
    robot_reach,
)

TOLERANCE = 1e-3
"""Of where a model's wheels are, how they are turned, their radii and `robot.radius`, m and rad."""


def model_faults(
    plant: MultibodyPlant, scene_graph: SceneGraph, model: ModelInstanceIndex, radius: float, floor: float | None
) -> Iterator[str]:
    """What is wrong with a model in a plant not yet finalized, of a `robot.radius`, m.

    `floor`: its height in base_link, m; None if the model has no wheels.
    """
    based = plant.HasBodyNamed("base_link", model)
    if not based:
        yield "it has no link base_link; allowed: link base_link, whose x axis is the robot's heading"
    for name in massless_links(plant, plant.GetBodyIndices(model)):
        yield f"link {name} has no mass; allowed: <inertial> with a mass and an inertia"
    if not based:
        return
    reach, link = robot_reach(plant, scene_graph, link_poses(plant, model))
    if reach > radius + TOLERANCE:
        yield f"link {link} reaches {reach:.3f} m from the robot's axis; allowed: up to robot.radius, {radius:g} m"
    if floor is not None:
        yield from _floor_faults(plant, scene_graph, model, floor)


def _floor_faults(
    plant: MultibodyPlant, scene_graph: SceneGraph, model: ModelInstanceIndex, floor: float
) -> Iterator[str]:
    """What would lift the wheels off the floor."""
    inspector = scene_graph.model_inspector()
    for index, X_BL in link_poses(plant, model).items():
        body = plant.get_body(index)
        for geometry in collision_shapes(plant, scene_graph, body):
            low = lowest(inspector, geometry, X_BL)
            if low < floor - TOLERANCE and floor_contact(inspector, geometry) is None:
                yield (
                    f"link {body.name()} reaches {1e3 * (floor - low):.0f} mm lower than the wheels; allowed: down to "
                    "the floor that they stand on"
                )
