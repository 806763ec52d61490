"""A goal that stays where it is."""

from collections.abc import Sequence

import numpy as np
from pydrake.systems.framework import LeafSystem


class FixedGoal(LeafSystem):
    """The goal as discrete state; Drake's `ConstantVectorSource` would have the planner look at it at every step.

    ```
    ┌───────────┐
    │ FixedGoal ├──> goal
    └───────────┘
    ```

    Ports:
        goal: vector (x, y) in the world frame W, m.
    """

    def __init__(self, goal: Sequence[float] | np.ndarray) -> None:
        """
        Args:
            goal: (x, y) in W, m.
        """
        super().__init__()
        self.DeclareStateOutputPort("goal", self.DeclareDiscreteState(np.asarray(goal, dtype=float)))
