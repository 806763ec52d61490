"""A goal that is moved by hand."""

import numpy as np
from pydrake.geometry import Meshcat
from pydrake.systems.framework import Context, DiscreteValues, EventStatus, LeafSystem

from drake_starnav.worlds.world import World

SLIDERS = {"goal x": ("ArrowLeft", "ArrowRight"), "goal y": ("ArrowDown", "ArrowUp")}
"""Labels in Meshcat's panel -> the keys that move them down and up."""
STEP = 0.05
"""Of the sliders, m."""


class SliderGoal(LeafSystem):
    """Reads the goal from two sliders in Meshcat's panel.

    ```
    ┌────────────┐
    │ SliderGoal ├──> goal
    └────────────┘
    ```

    Ports:
        goal: vector (x, y) in the world frame W, m; discrete state: where the sliders stood at the last update.

    The sliders reach over the world's extent and begin at its goal. A run with it is not repeatable.
    """

    def __init__(self, meshcat: Meshcat, world: World, period: float = 0.1) -> None:
        """
        Args:
            meshcat: whose panel gets the sliders.
            world: where the goal is at first, and how far it may go.
            period: of the updates, s.
        """
        super().__init__()
        self._meshcat = meshcat
        x0, y0, x1, y1 = world.extent
        for label, low, high, value in zip(SLIDERS, (x0, y0), (x1, y1), world.goal, strict=True):
            meshcat.AddSlider(label, low, high, STEP, value, *SLIDERS[label])
        # What the sliders show at first is rounded: until one is moved the goal is the world's.
        self._first, self._goal = self._sliders(), np.array(world.goal)
        self.DeclareStateOutputPort("goal", self.DeclareDiscreteState(self._goal))
        self.DeclarePeriodicDiscreteUpdateEvent(period, 0.0, self._read)

    def _read(self, context: Context, values: DiscreteValues) -> EventStatus:
        sliders = self._sliders()
        values.set_value(self._goal if np.array_equal(sliders, self._first) else sliders)
        return EventStatus.Succeeded()

    def _sliders(self) -> np.ndarray:
        return np.array([self._meshcat.GetSliderValue(label) for label in SLIDERS])
