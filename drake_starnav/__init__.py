"""Lidar navigation through unknown clutter, as Drake systems: star-shaped roadmap and modulation.

What is listed in `__all__` is the public interface; it is imported when first used, so that the numerics can be used
without Drake.
"""

import importlib
from typing import Any

_PUBLIC = {
    "StarnavError": "errors",
    "RobotParameters": "robot",
    "LaserScan": "scan",
    "LidarParameters": "lidar",
    "StarRegion": "stars",
    "PlannerParameters": "roadmap",
    "StarRoadmap": "roadmap",
    "Guidance": "roadmap",
    "ControllerParameters": "control",
    "World": "worlds",
    "make_world": "worlds",
    "Scenario": "scenario",
    "load_scenario": "scenario",
    "scenario_names": "scenario",
    "LidarSensor": "systems.lidar_sensor",
    "StarPerception": "systems.star_perception",
    "StarRoadmapPlanner": "systems.star_roadmap_planner",
    "DsmController": "systems.dsm_controller",
    "BaselineController": "systems.baseline_controller",
    "MpcController": "systems.mpc_controller",
    "WheelSpeedCommand": "systems.wheel_speed_command",
    "CollisionMonitor": "systems.collision_monitor",
    "StarRoadmapVisualizer": "systems.star_roadmap_visualizer",
    "NavigationStation": "station",
    "add_navigation": "diagram",
    "make_diagram": "diagram",
    "Trial": "simulation",
    "run_trial": "simulation",
}

__all__ = list(_PUBLIC)


def __getattr__(name: str) -> Any:
    if name not in _PUBLIC:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(importlib.import_module(f"{__name__}.{_PUBLIC[name]}"), name)


def __dir__() -> list[str]:
    return sorted(__all__)
