# The public names, each in one line, by subject. __init__.py reads this file.
# isort: skip_file
from drake_starnav.scenario.schema import Scenario as Scenario
from drake_starnav.loading import load_scenario as load_scenario
from drake_starnav.loading import parse_scenario as parse_scenario
from drake_starnav.scenario.scenario_file import save_scenario as save_scenario
from drake_starnav.scenario.margins import derive_margins as derive_margins
from drake_starnav.robot import RobotParameters as RobotParameters
from drake_starnav.lidar.sensor_model import LidarParameters as LidarParameters
from drake_starnav.planning.parameters import PlannerParameters as PlannerParameters
from drake_starnav.control.parameters import ControllerParameters as ControllerParameters
from drake_starnav.moving.parameters import DynamicObstacleParameters as DynamicObstacleParameters
from drake_starnav.errors import StarnavError as StarnavError
from drake_starnav.worlds.world import World as World
from drake_starnav.worlds import make_world as make_world
from drake_starnav.simulation.run import run_trial as run_trial
from drake_starnav.simulation.trial import Trial as Trial
from drake_starnav.navigation.parts import Navigation as Navigation
from drake_starnav.navigation.parts import Parts as Parts
from drake_starnav.navigation.wiring import add_navigation as add_navigation
from drake_starnav.navigation.diagram import make_diagram as make_diagram
from drake_starnav.station.plant import make_simulator as make_simulator
from drake_starnav.station.navigation_station import NavigationStation as NavigationStation
from drake_starnav.station.robot_interface import RobotInterface as RobotInterface
from drake_starnav.station.lidar_sensor import LidarMount as LidarMount
from drake_starnav.station.lidar_sensor import LidarSensor as LidarSensor
from drake_starnav.station.lidar_mounts import ApplyLidarConfig as ApplyLidarConfig
from drake_starnav.station.lidar_mounts import LidarConfig as LidarConfig
from drake_starnav.simulation.monitors import ArrivalMonitor as ArrivalMonitor
from drake_starnav.station.monitors import CollisionMonitor as CollisionMonitor
from drake_starnav.lidar.laser_scan import LaserScan as LaserScan
from drake_starnav.systems.obstacle_tracker import ObstacleTracker as ObstacleTracker
from drake_starnav.systems.star_perception import StarPerception as StarPerception
from drake_starnav.systems.scan_matcher import ScanMatcher as ScanMatcher
from drake_starnav.systems.star_roadmap_planner import StarRoadmapPlanner as StarRoadmapPlanner
from drake_starnav.systems.fixed_goal import FixedGoal as FixedGoal
from drake_starnav.systems.goal_sequence import GoalSequence as GoalSequence
from drake_starnav.planning.guidance import Guidance as Guidance
from drake_starnav.moving.kalman_tracks import Tracks as Tracks
from drake_starnav.geometry.footprint import Footprint as Footprint
from drake_starnav.systems.dsm_controller import DsmController as DsmController
from drake_starnav.systems.twist_shield import TwistShield as TwistShield
from drake_starnav.systems.twist_shield import Unshielded as Unshielded
from drake_starnav.safety.certificates import Certificate as Certificate
from drake_starnav.safety.zones import KeepOut as KeepOut
from drake_starnav.safety.zones import SpeedZone as SpeedZone
from drake_starnav.visualization.star_roadmap_visualizer import StarRoadmapVisualizer as StarRoadmapVisualizer
from drake_starnav.visualization.recorder import Recorder as Recorder

__version__: str
__all__: list[str]
