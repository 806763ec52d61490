"""A robot that moves along the planner's path exactly, and worlds that it does so in."""

import dataclasses
from collections.abc import Callable

import numpy as np

from drake_starnav.planning import PlannerParameters, PlannerState, PlannerStatus, plan_step
from drake_starnav.worlds.world import World
from tests.helpers.scans import RADIUS, cast, distance, noisy, planner_input

PERIOD = 0.05
SLACK = 0.03
"""What smoothed corners and the sampling of lines cost at most; it is the certificate that rules out contact, m."""
BAFFLES = World(
    "baffles",
    (0.0, 0.0, 0.0),
    (5.0, 1.0),
    polygons=([(1.4, -2.0), (1.6, -2.0), (1.6, 1.0), (1.4, 1.0)], [(3.2, 0.0), (3.4, 0.0), (3.4, 3.0), (3.2, 3.0)]),
    cylinders=[(4.3, -0.9, 0.3)],
    bounds=(-1.0, -2.0, 6.0, 3.0),
)
VAULT = World(
    "vault",
    (0.0, 0.0, 0.0),
    (3.0, 0.0),
    polygons=(
        [(2.2, -0.8), (3.8, -0.8), (3.8, -0.7), (2.2, -0.7)],
        [(2.2, 0.7), (3.8, 0.7), (3.8, 0.8), (2.2, 0.8)],
        [(2.1, -0.8), (2.2, -0.8), (2.2, 0.8), (2.1, 0.8)],
        [(3.8, -0.8), (3.9, -0.8), (3.9, 0.8), (3.8, 0.8)],
    ),
    bounds=(-1.0, -2.0, 5.0, 2.0),
)


def drive(
    world: World,
    parameters: PlannerParameters,
    steps: int,
    speed: float = 0.8,
    refused: Callable[[np.ndarray], bool] = lambda place: False,
    averted: float = 0.0,
    turning: float = 0.0,
    stop: bool = True,
    begin: PlannerState | None = None,
    noise: tuple[float, np.random.Generator] | None = None,
) -> list[PlannerState]:
    """The planner's states until the goal is reached (unless `stop` is False), it gives up, or the steps are used up.

    The robot does not move to places that are `refused`; it looks `averted` (rad) from its way, swaying, and
    goes on `turning` (rad/s). `begin` is the state to begin with, if it is not the first one; `noise` the standard
    deviation of the ranges, m.
    """
    position, goal = np.array(world.start[:2]), np.array(world.goal)
    state, states = begin or PlannerState.initial(parameters, RADIUS), []
    first = round(state.roadmap.nodes[-1].scan.time / PERIOD) + 1 if len(state.roadmap) else 0
    for k in range(first, first + steps):
        path = state.guidance.path
        way = path[0] - position if len(path) else np.array((1.0, 0.0))
        pose = np.array(
            (*position, np.arctan2(way[1], way[0]) + averted + turning * PERIOD * k + 0.3 * np.sin(0.1 * k))
        )
        scan = dataclasses.replace(cast(world, pose), time=PERIOD * k)
        scan = scan if noise is None else noisy(scan, *noise)
        state = plan_step(state, planner_input(scan, pose, goal, parameters=parameters))
        states.append(state)
        if state.status is PlannerStatus.UNREACHABLE or (stop and np.hypot(*(position - goal)) < 0.05):
            break
        left = speed * PERIOD
        for point in state.guidance.path:
            offset = point - position
            away = float(np.hypot(*offset))
            step = min(left, away)
            moved = position + offset * (step / max(away, 1e-12))
            if refused(moved):
                break
            position = moved
            left -= step
        assert distance(world, position[None])[0] > RADIUS - SLACK
    return states
