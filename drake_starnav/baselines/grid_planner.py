"""A planner that searches a grid of hits, to compare the star roadmap with; written as a user's own would be."""

from typing import Any

import numpy as np
from pydrake.common.value import Value
from pydrake.systems.framework import Context, EventStatus, LeafSystem, State

from drake_starnav.baselines.grid_astar import add_hits, plan_on_grid
from drake_starnav.lidar.laser_scan import USUAL_COVER_RADIUS
from drake_starnav.planning.guidance import Guidance
from drake_starnav.surroundings.observation import Observation
from drake_starnav.systems.release import declare_value, declare_vector
from drake_starnav.utils.snapshot import snapshot

PERIOD = 0.1
"""Period of the updates, s."""


@snapshot
class GridPlan:
    """State of the planner, W, m.

    Attributes:
        hits: shape (n, 2), all so far.
        path: shape (k, 2), to the goal.
    """

    hits: np.ndarray
    path: np.ndarray


class GridPlanner(LeafSystem):
    """Plans by A* on a grid of all hits so far, as if what is unknown were free.

    ```
                   ┌─────────────┐
    observation ──>│ GridPlanner ├──> guidance
    goal ─────────>│             ├──> short_term_goal
                   └─────────────┘
    ```

    Ports:
        observation: abstract, `Observation` of the latest scan.
        goal: vector (x, y) in W, m.
        guidance: abstract, `Guidance` for the controller, with the region of that scan.
        short_term_goal: vector (x, y) in W, m; the goal before the first plan.
    """

    def __init__(self, robot_radius: float = USUAL_COVER_RADIUS) -> None:
        """`robot_radius`: its cover radius, m."""
        super().__init__()
        self._radius = robot_radius
        self._observation = self.DeclareAbstractInputPort("observation", Value(Observation.none()))
        self._goal = self.DeclareVectorInputPort("goal", 2)
        self._plan = self.DeclareAbstractState(Value[object](GridPlan(np.zeros((0, 2)), np.zeros((0, 2)))))
        self.DeclarePeriodicUnrestrictedUpdateEvent(PERIOD, 0.0, self._update)
        declare_value(self, "guidance", Guidance.none(), GridPlanner._guidance)
        declare_vector(self, "short_term_goal", 2, GridPlanner._short_term_goal)

    def _update(self, context: Context, state: State) -> EventStatus:
        observation = self._observation.Eval(context)
        hits = add_hits(self._state(context).hits, observation.scan.points(observation.pose), self._radius)
        path = plan_on_grid(hits, observation.pose[:2], self._goal.Eval(context), self._radius)
        state.get_mutable_abstract_state(int(self._plan)).set_value(GridPlan(hits, path))
        return EventStatus.Succeeded()

    def _state(self, context: Context) -> GridPlan:
        plan: GridPlan = context.get_abstract_state(int(self._plan)).get_value()
        return plan

    def _guidance(self, context: Context) -> Guidance:
        region = self._observation.Eval(context).region
        return Guidance.along(self._state(context).path, [region] if region else [])

    def _short_term_goal(self, context: Context) -> np.ndarray:
        path = self._state(context).path
        return path[0] if len(path) else self._goal.Eval(context)


def grid_astar(scenario: Any) -> dict[str, Any]:
    """Return what drives in the place of our parts: the planner, before our controller and shield."""
    return {"planner": GridPlanner(scenario.robot.shape.cover_radius)}
