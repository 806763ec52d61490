"""Lidar navigation through unknown clutter, as Drake systems: star-shaped roadmap and modulation.

What is listed in `__all__` is the public interface: it changes only with an entry in the changelog. All else is
internal, whatever its name. A public name is imported when first used, so that the numerics can be used without Drake.
"""

import importlib

__version__ = "0.1.0"

TYPE_CHECKING = False  # as in typing, which takes half the time until a command hears of Ctrl-C
if TYPE_CHECKING:  # the same names, for type checkers and editors
    from drake_starnav.baselines.known_obstacles import KnownObstacles as KnownObstacles
    from drake_starnav.control import ControllerParameters as ControllerParameters
    from drake_starnav.control.certificates import Certificate as Certificate
    from drake_starnav.control.motion import BrakingMotion as BrakingMotion
    from drake_starnav.control.zones import KeepOut as KeepOut
    from drake_starnav.control.zones import SpeedZone as SpeedZone
    from drake_starnav.errors import StarnavError as StarnavError
    from drake_starnav.geometry.trajectory import Motion as Motion
    from drake_starnav.lidar.laser_scan import LaserScan as LaserScan
    from drake_starnav.lidar.scan_log import read_scan_log as read_scan_log
    from drake_starnav.lidar.scan_records import LoggedScan as LoggedScan
    from drake_starnav.lidar.sensor_model import LidarParameters as LidarParameters
    from drake_starnav.navigation import Navigation as Navigation
    from drake_starnav.navigation import Parts as Parts
    from drake_starnav.navigation import add_navigation as add_navigation
    from drake_starnav.navigation import make_diagram as make_diagram
    from drake_starnav.planning import PlannerInput as PlannerInput
    from drake_starnav.planning import PlannerParameters as PlannerParameters
    from drake_starnav.planning import PlannerState as PlannerState
    from drake_starnav.planning import PlannerStatus as PlannerStatus
    from drake_starnav.planning import StarRoadmap as StarRoadmap
    from drake_starnav.planning import plan_step as plan_step
    from drake_starnav.planning.guidance import Guidance as Guidance
    from drake_starnav.regions import Observation as Observation
    from drake_starnav.regions import StarRegion as StarRegion
    from drake_starnav.regions.safe_region import SafetyStar as SafetyStar
    from drake_starnav.regions.star_region import scan_region as scan_region
    from drake_starnav.robot import RobotParameters as RobotParameters
    from drake_starnav.scenario import Scenario as Scenario
    from drake_starnav.scenario import load_scenario as load_scenario
    from drake_starnav.scenario import parse_scenario as parse_scenario
    from drake_starnav.scenario import save_scenario as save_scenario
    from drake_starnav.scenario import scenario_names as scenario_names
    from drake_starnav.scenario.faults import DriveParameters as DriveParameters
    from drake_starnav.scenario.faults import LocalizationParameters as LocalizationParameters
    from drake_starnav.scenario.margins import derive_margins as derive_margins
    from drake_starnav.scenario.recording import RecordingParameters as RecordingParameters
    from drake_starnav.simulation import Trial as Trial
    from drake_starnav.simulation import run_trial as run_trial
    from drake_starnav.station.arrival_monitor import ArrivalMonitor as ArrivalMonitor
    from drake_starnav.station.collision_monitor import CollisionMonitor as CollisionMonitor
    from drake_starnav.station.lidar_config import ApplyLidarConfig as ApplyLidarConfig
    from drake_starnav.station.lidar_config import LidarConfig as LidarConfig
    from drake_starnav.station.lidar_sensor import LidarMount as LidarMount
    from drake_starnav.station.lidar_sensor import LidarSensor as LidarSensor
    from drake_starnav.station.navigation_station import NavigationStation as NavigationStation
    from drake_starnav.station.navigation_station import add_station as add_station
    from drake_starnav.station.plant import make_simulator as make_simulator
    from drake_starnav.station.plant import plant_config as plant_config
    from drake_starnav.station.robot_interface import RobotInterface as RobotInterface
    from drake_starnav.station.robot_interface import connect_robot as connect_robot
    from drake_starnav.station.robot_model import add_robot as add_robot
    from drake_starnav.station.wheel_speed_command import WheelSpeedCommand as WheelSpeedCommand
    from drake_starnav.station.world_geometry import add_ground as add_ground
    from drake_starnav.station.world_geometry import add_world as add_world
    from drake_starnav.systems.baseline_controller import BaselineController as BaselineController
    from drake_starnav.systems.convex_sets import convex_cover as convex_cover
    from drake_starnav.systems.dsm_controller import DsmController as DsmController
    from drake_starnav.systems.fixed_goal import FixedGoal as FixedGoal
    from drake_starnav.systems.fixed_path import FixedPath as FixedPath
    from drake_starnav.systems.obstacle_tracker import ObstacleTracker as ObstacleTracker
    from drake_starnav.systems.release import release as release
    from drake_starnav.systems.scan_matcher import ScanMatcher as ScanMatcher
    from drake_starnav.systems.star_perception import StarPerception as StarPerception
    from drake_starnav.systems.star_roadmap_planner import StarRoadmapPlanner as StarRoadmapPlanner
    from drake_starnav.systems.twist_shield import TwistShield as TwistShield
    from drake_starnav.systems.twist_shield import Unshielded as Unshielded
    from drake_starnav.tracking import DynamicObstacleParameters as DynamicObstacleParameters
    from drake_starnav.tracking import Tracks as Tracks
    from drake_starnav.visualization.inline_page import InlinePage as InlinePage
    from drake_starnav.visualization.recorder import Recorder as Recorder
    from drake_starnav.visualization.star_roadmap_visualizer import StarRoadmapVisualizer as StarRoadmapVisualizer
    from drake_starnav.visualization.world_figure import draw_goal as draw_goal
    from drake_starnav.visualization.world_figure import draw_robot as draw_robot
    from drake_starnav.visualization.world_figure import draw_world as draw_world
    from drake_starnav.visualization.world_figure import save_figure as save_figure
    from drake_starnav.visualization.world_figure import world_axes as world_axes
    from drake_starnav.worlds import World as World
    from drake_starnav.worlds import make_world as make_world

_PUBLIC = {
    "StarnavError": "errors",
    "RobotParameters": "robot",
    "LaserScan": "lidar.laser_scan",
    "LidarParameters": "lidar.sensor_model",
    "LocalizationParameters": "scenario.faults",
    "DriveParameters": "scenario.faults",
    "DynamicObstacleParameters": "tracking",
    "StarRegion": "regions",
    "PlannerParameters": "planning",
    "StarRoadmap": "planning",
    "Observation": "regions",
    "PlannerState": "planning",
    "PlannerStatus": "planning",
    "Guidance": "planning.guidance",
    "SafetyStar": "regions.safe_region",
    "Certificate": "control.certificates",
    "BrakingMotion": "control.motion",
    "KeepOut": "control.zones",
    "SpeedZone": "control.zones",
    "Tracks": "tracking",
    "ControllerParameters": "control",
    "World": "worlds",
    "make_world": "worlds",
    "Scenario": "scenario",
    "load_scenario": "scenario",
    "parse_scenario": "scenario",
    "save_scenario": "scenario",
    "scenario_names": "scenario",
    "derive_margins": "scenario.margins",
    "LidarSensor": "station.lidar_sensor",
    "LidarMount": "station.lidar_sensor",
    "LidarConfig": "station.lidar_config",
    "ApplyLidarConfig": "station.lidar_config",
    "convex_cover": "systems.convex_sets",
    "FixedGoal": "systems.fixed_goal",
    "FixedPath": "systems.fixed_path",
    "ObstacleTracker": "systems.obstacle_tracker",
    "StarPerception": "systems.star_perception",
    "StarRoadmapPlanner": "systems.star_roadmap_planner",
    "ScanMatcher": "systems.scan_matcher",
    "DsmController": "systems.dsm_controller",
    "BaselineController": "systems.baseline_controller",
    "TwistShield": "systems.twist_shield",
    "Unshielded": "systems.twist_shield",
    "WheelSpeedCommand": "station.wheel_speed_command",
    "CollisionMonitor": "station.collision_monitor",
    "ArrivalMonitor": "station.arrival_monitor",
    "StarRoadmapVisualizer": "visualization.star_roadmap_visualizer",
    "RecordingParameters": "scenario.recording",
    "Recorder": "visualization.recorder",
    "InlinePage": "visualization.inline_page",
    "Motion": "geometry.trajectory",
    "NavigationStation": "station.navigation_station",
    "add_station": "station.navigation_station",
    "RobotInterface": "station.robot_interface",
    "add_robot": "station.robot_model",
    "connect_robot": "station.robot_interface",
    "plant_config": "station.plant",
    "make_simulator": "station.plant",
    "Navigation": "navigation",
    "Parts": "navigation",
    "add_navigation": "navigation",
    "make_diagram": "navigation",
    "Trial": "simulation",
    "run_trial": "simulation",
    "add_world": "station.world_geometry",
    "add_ground": "station.world_geometry",
    "KnownObstacles": "baselines.known_obstacles",
    "world_axes": "visualization.world_figure",
    "draw_world": "visualization.world_figure",
    "draw_robot": "visualization.world_figure",
    "draw_goal": "visualization.world_figure",
    "save_figure": "visualization.world_figure",
    "LoggedScan": "lidar.scan_records",
    "read_scan_log": "lidar.scan_log",
    "PlannerInput": "planning",
    "plan_step": "planning",
    "scan_region": "regions.star_region",
    "release": "systems.release",
}

__all__ = list(_PUBLIC)


def __getattr__(name: str) -> object:
    if name not in _PUBLIC:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(importlib.import_module(f"{__name__}.{_PUBLIC[name]}"), name)


def __dir__() -> list[str]:
    return sorted(__all__)
