"""Sliders in Meshcat's panel that move the goal while a run is watched."""

from collections.abc import Callable

import numpy as np
from pydrake.geometry import Meshcat
from pydrake.systems.framework import Context, DiscreteValues, EventStatus, LeafSystem

from drake_starnav.worlds.world import World

SLIDERS = ("goal x", "goal y")
"""Labels of the sliders."""


def add_goal_sliders(meshcat: Meshcat, world: World) -> Callable[[], np.ndarray | None]:
    """Add two sliders to Meshcat's panel that span a world and begin at its goal.

    Returns a function for `SliderGoal` that reads them: None until one has been moved.
    """
    x0, y0, x1, y1 = world.extent
    for label, low, high, value in zip(SLIDERS, (x0, y0), (x1, y1), world.goal, strict=True):
        meshcat.AddSlider(label, low, high, 0.01, value)

    def values() -> np.ndarray:
        return np.array([meshcat.GetSliderValue(label) for label in SLIDERS])

    first_values = values()  # rounded to whole steps, unlike the world's goal

    def read() -> np.ndarray | None:
        current_values = values()
        return None if np.array_equal(current_values, first_values) else current_values

    return read


class SliderGoal(LeafSystem):
    """Takes the goal from outside the simulation, such as sliders in Meshcat's panel.

    ```
    ┌────────────┐
    │ SliderGoal ├──> goal
    └────────────┘
    ```

    Ports:
        goal: vector (x, y) in the world frame W, m; discrete state: what was read at the last update.

    What a run with it does depends on when the goal is moved, and cannot be repeated.
    """

    def __init__(
        self, goal: tuple[float, float], read: Callable[[], np.ndarray | None], *, period: float = 0.1
    ) -> None:
        """
        Args:
            goal: where there is no other, (x, y), W, m.
            read: says where the goal is now, shape (2,), W, m, or None; see `add_goal_sliders`.
            period: of the updates, s.
        """
        super().__init__()
        self._goal, self._read = np.array(goal, dtype=float), read
        self.DeclareStateOutputPort("goal", self.DeclareDiscreteState(self._goal))
        self.DeclarePeriodicDiscreteUpdateEvent(period, 0.0, self._update)

    def _update(self, context: Context, values: DiscreteValues) -> EventStatus:
        new_goal = self._read()
        values.set_value(self._goal if new_goal is None else new_goal)
        return EventStatus.Succeeded()
