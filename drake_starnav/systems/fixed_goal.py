"""A goal that stays where it is."""

from collections.abc import Sequence

import numpy as np
from pydrake.systems.framework import LeafSystem


class FixedGoal(LeafSystem):
    """A constant goal, held as discrete state; a `ConstantVectorSource` would have the planner evaluated at every step.

    ```
    ┌───────────┐
    │ FixedGoal ├──> goal
    └───────────┘
    ```

    Ports:
        goal: vector (x, y) in the world frame W, m.
    """

    def __init__(self, goal: Sequence[float] | np.ndarray) -> None:
        """Hold the goal (x, y), W, m."""
        super().__init__()
        self.DeclareStateOutputPort("goal", self.DeclareDiscreteState(np.asarray(goal, dtype=float)))
