"""Pages of worlds without a run: obstacles, zones, the robot at its start, the goal, the shortest path between them."""

from pathlib import Path

import numpy as np
import shapely
from pydrake.geometry import Rgba
from pydrake.systems.framework import DiagramBuilder

from drake_starnav.scenario.schema import Scenario
from drake_starnav.station.navigation_station import NavigationStation
from drake_starnav.visualization import meshes
from drake_starnav.visualization.meshcat_stage import add_scene, quiet_meshcat
from drake_starnav.visualization.page import ROOT, Cameras, Caption
from drake_starnav.visualization.recorder import robot_path, write_html
from drake_starnav.worlds.world import World


def write_world_page(world: World, scenario: Scenario, path: np.ndarray | None, title: str, file: Path) -> None:
    """Write a page that opens offline and shows a world, with its footprints, and a scenario's zones and robot.

    The shortest path has shape (k, 2), W, m; None if there is none.
    """
    meshcat = quiet_meshcat()
    builder = DiagramBuilder()
    station = builder.AddSystem(NavigationStation(world, scenario))
    add_scene(builder, station.plant, station.scene_graph, meshcat, station.floor, station.geometry_query)
    diagram = builder.Build()
    context = diagram.CreateDefaultContext()
    command = station.GetInputPort("drive.twist_command")
    command.FixValue(station.GetMyMutableContextFromRoot(context), np.zeros(command.size()))
    diagram.ForcedPublish(context)
    shapes = {"goal": meshes.goal_star(world.goal, max(scenario.robot.radius, 0.15))}
    if path is not None:
        shapes["path"] = meshes.ribbon(path, meshes.LINE_WIDTH, meshes.LAYERS["path"].height)
    for name in map(meshes.zone_layer, scenario.zones):
        areas = [shapely.Polygon(zone.polygon) for zone in scenario.zones if meshes.zone_layer(zone) == name]
        shapes[name] = meshes.area(shapely.union_all(areas), meshes.LAYERS[name].height)
    layers = meshes.with_scene({name: meshes.LAYERS[name] for name in shapes}, world)
    ways = shapely.MultiLineString([path[:, 1:] for path in world.moving_obstacles.paths])
    shapes["moving_obstacles"] = meshes.area(ways.buffer(0.25 * meshes.LINE_WIDTH), 0.01)
    for name, mesh in shapes.items():
        if len(mesh):
            color = Rgba(*layers[name].color, meshes.ZONE_OPACITY if name.startswith("zones/") else 1.0)
            meshcat.SetTriangleMesh(f"{ROOT}/{name}", mesh.vertices.T, mesh.faces.T, color)
    heading, *lines = title.split(" · ")
    cameras = Cameras(world.extent, "top", robot_path(station), world.start[:2])
    write_html(meshcat, file, Caption(heading, tuple(lines), layers), cameras)
