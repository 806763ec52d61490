"""A robot without a plant in a scene: perception, roadmap and controller as in the diagram, twists followed exactly."""

import math
from dataclasses import dataclass

import numpy as np

from drake_starnav.control import ControllerInputs, ControllerParameters, follow_guidance
from drake_starnav.moving.avoidance import avoid_collision
from drake_starnav.moving.certificate import make_certificates
from drake_starnav.moving.parameters import DynamicObstacleParameters
from drake_starnav.moving.tracker import TrackedObstacles, TrackerState, track
from drake_starnav.planning import PlannerInput, PlannerParameters, PlannerState, plan_step
from drake_starnav.robot import RobotParameters
from drake_starnav.safety.shield import find_certified_twist, ramp_twist
from drake_starnav.surroundings.perception import PerceptionSettings, PerceptionState, perceive
from tests.helpers.motions import actuation
from tests.helpers.scans import MARGINS
from tests.helpers.scenes import PERIOD, Scene, hall, moved

ROBOT, PLANNER, CONTROLLER = RobotParameters(), PlannerParameters(), ControllerParameters(rate=40.0)
SETTINGS = PerceptionSettings(MARGINS, ROBOT.shape)
TICKS = 2
"""Commands from scan to scan."""


@dataclass(frozen=True)
class Run:
    """How a run ended: reached, collision (while it moved), struck (while it stood) or timeout; and its poses."""

    outcome: str
    poses: np.ndarray
    plan: PlannerState


def command(inputs: ControllerInputs, tracked: TrackedObstacles, robot: RobotParameters = ROBOT) -> np.ndarray:
    """Return what is driven next: what the controller proposes, as far as the shield accepts it."""
    pose, twist, _, surroundings = inputs
    commands = actuation(robot, 1.0 / CONTROLLER.rate)
    certificates = make_certificates(surroundings, MARGINS.safety, commands, pose[:2], tracked)
    way = avoid_collision(inputs, tracked, certificates, commands, robot)
    proposed = follow_guidance(inputs, robot).twist if way is None else way
    return np.array(ramp_twist(twist, find_certified_twist(pose, twist, proposed, certificates, commands)[0], commands))


def drive(
    scene: Scene,
    start: np.ndarray,
    goal: np.ndarray,
    obstacles: DynamicObstacleParameters,
    *,
    robot: RobotParameters = ROBOT,
    duration: float = 30.0,
    seed: int = 0,
) -> Run:
    """Drive from a pose to a goal (2,)."""
    rng = np.random.default_rng(seed)
    pose, twist = np.array(start, dtype=float), np.zeros(2)
    known, perceived = TrackerState(), PerceptionState.initial()
    plan = PlannerState.initial(PLANNER, robot.radius)
    tick = PERIOD / TICKS
    poses = [pose]
    for k in range(round(duration / tick)):
        time = k * tick
        if math.dist(pose[:2], goal) < 0.3:
            return Run("reached", np.array(poses), plan)
        if k % TICKS == 0:
            known = track(known, scene.scan(time, pose, rng), pose, obstacles)
            perceived = perceive(perceived, (known.scan,), pose, SETTINGS)
            plan = plan_step(
                plan, PlannerInput(perceived.observation, pose[:2], goal, time, PLANNER, MARGINS, robot.radius)
            )
        tracked = TrackedObstacles(known.tracks, time - known.tracks.time, obstacles)
        driven = command(ControllerInputs(pose, twist, plan.guidance, perceived.surroundings), tracked, robot)
        pose = moved(pose, 0.5 * (twist + driven), tick)
        twist = driven
        poses.append(pose)
        if len(scene.radii) and (np.hypot(*(scene.at(time + tick) - pose[:2]).T) - scene.radii).min() < robot.radius:
            return Run("collision" if abs(twist[0]) > 0.02 else "struck", np.array(poses), plan)
    return Run("timeout", np.array(poses), plan)


def pacing(places: np.ndarray, velocities: np.ndarray, half: float) -> Scene:
    """Discs of 0.25 m that go straight and bounce off the walls of a square room of half a side `half` (m)."""
    reach = half - 0.25

    def at(time: float) -> np.ndarray:
        way = (places + velocities * time + reach) % (4.0 * reach)
        return np.where(way < 2.0 * reach, way, 4.0 * reach - way) - reach

    return Scene(hall(half=half), (0.25,) * len(places), at)
