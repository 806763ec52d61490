"""Drive a robot without dynamics by the whole pipeline, and collect the inputs of its steps."""

import math
import time
from dataclasses import dataclass, field, replace

import numpy as np

from drake_starnav.control import ControllerInputs, followed
from drake_starnav.lidar.laser_scan import LaserScan
from drake_starnav.planning import PlannerInput, PlannerState, PlannerStatus, StarRoadmap, plan_step
from drake_starnav.planning.guidance import Guidance
from drake_starnav.robot.motion import Actuation
from drake_starnav.safety.certificates import standard_certificates
from drake_starnav.safety.shield import shielded
from drake_starnav.scenario.margins import derive_margins
from drake_starnav.scenario.schema import Scenario
from drake_starnav.surroundings.perception import SCAN_MEMORY, Perceived, PerceptionSettings, perceive
from drake_starnav.surroundings.safe_region import CertifiedRegion, ScanMemory, certified_region
from drake_starnav.worlds import World
from drake_starnav.worlds.view import scan_from, visible_shapes

SCENARIO = Scenario("default", None)
LIDAR, ROBOT, PLANNER, CONTROLLER = SCENARIO.lidar, SCENARIO.robot, SCENARIO.planner, SCENARIO.controller
MARGINS = replace(derive_margins(SCENARIO), smoothed_beams=0)
"""Of the default scenario, but the plain pipeline does not smooth the certificate's ranges."""
SAFE_RADIUS = ROBOT.radius + MARGINS.safety
SETTINGS = PerceptionSettings(MARGINS, ROBOT.shape)
COMMANDS = Actuation(ROBOT.limits, ROBOT.shape, 1.0 / CONTROLLER.rate, CONTROLLER.delay)
ARRIVED = 0.3
"""At the goal the drive ends this far from it, m."""
SAMPLED = 10
"""One in this many scans and commands of a drive is kept, and the roadmap of one in this many plans."""


@dataclass(frozen=True)
class ScanMoment:
    """Inputs of a scan's processing; `before` holds the earlier scans."""

    scan: LaserScan
    pose: np.ndarray
    before: Perceived


@dataclass(frozen=True)
class CommandMoment:
    """Inputs of a command; FOA needs the scan with its pose instead of regions and star."""

    pose: np.ndarray
    twist: np.ndarray
    guidance: Guidance
    star: CertifiedRegion
    scan: LaserScan
    scan_pose: np.ndarray


@dataclass
class Drive:
    """Samples of one drive.

    Attributes:
        scans, commands: some of them.
        plans: for every search of the roadmap, its number of nodes and the time of that step, s.
        roadmaps: some of those searched, with the goal, shape (2,), W, m.
    """

    scans: list[ScanMoment] = field(default_factory=list)
    commands: list[CommandMoment] = field(default_factory=list)
    plans: list[tuple[int, float]] = field(default_factory=list)
    roadmaps: list[tuple[StarRoadmap, np.ndarray]] = field(default_factory=list)


def scan_processing(moment: ScanMoment) -> Perceived:
    """The complete processing of a scan."""
    return perceive(moment.before, (moment.scan,), moment.pose, SETTINGS)


def safety(moment: ScanMoment, distance: np.ndarray) -> tuple[CertifiedRegion, ScanMemory]:
    """The certified region with the scan added to the memory."""
    scan, pose, reach = moment.scan, moment.pose, MARGINS.safety_range
    kept = reach + 2.0 * SAFE_RADIUS, SCAN_MEMORY
    return certified_region(moment.before.memory, scan, distance, pose, SAFE_RADIUS, reach, kept)


def command(moment: CommandMoment) -> np.ndarray:
    """The twist that controller and shield command."""
    inputs = ControllerInputs(moment.pose, moment.twist, moment.guidance, moment.star)
    desired = followed(inputs, ROBOT).twist
    asked = standard_certificates(moment.star, MARGINS.safety, COMMANDS, moment.pose[:2])
    return shielded(moment.pose, moment.twist, desired, asked, COMMANDS)[0]


def drive(world: World, seed: int, seconds: float) -> Drive:
    """Drive to the goal or for `seconds` of simulated time; twists are followed exactly."""
    kept = Drive()
    shapes, goal = visible_shapes(world), np.array(world.goal)
    pose, twist, period = np.array(world.start), np.zeros(2), 1.0 / CONTROLLER.rate
    state, known = PlannerState.initial(PLANNER, ROBOT.radius), Perceived.nothing()
    scan_count = 0
    for k in range(int(seconds * CONTROLLER.rate)):
        arrived = math.hypot(*(pose[:2] - goal)) < ARRIVED
        if arrived or state.status is PlannerStatus.UNREACHABLE:
            break
        if k * period >= scan_count / LIDAR.rate:
            scan, scan_pose = scan_from(shapes, pose, LIDAR, seed, scan_count), pose
            moment = ScanMoment(scan, pose, known)
            known = scan_processing(moment)
            if scan_count % SAMPLED == SAMPLED // 2:
                kept.scans.append(moment)
            begin, before = time.perf_counter(), state.plans
            seen = known.observation
            now = PlannerInput(seen, pose[:2], goal, k * period, PLANNER, MARGINS, ROBOT.radius)
            state = plan_step(state, now)
            spent = time.perf_counter() - begin
            if state.plans > before:
                kept.plans.append((len(state.roadmap), spent))
                if len(kept.plans) % SAMPLED == 1:
                    kept.roadmaps.append((state.roadmap, goal))
            guidance = state.guidance
            scan_count += 1
        command_inputs = CommandMoment(pose, twist, guidance, known.safety, scan, scan_pose)
        if k % SAMPLED == SAMPLED // 2 and len(guidance.path):
            kept.commands.append(command_inputs)
        twist = command(command_inputs)
        middle = pose[2] + 0.5 * twist[1] * period
        pose = pose + period * np.array((twist[0] * math.cos(middle), twist[0] * math.sin(middle), twist[1]))
    return kept
