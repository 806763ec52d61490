"""A system in a simulator of its own, whose inputs are fixed by hand."""

from typing import Any

import numpy as np
from pydrake.common.value import Value
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import LeafSystem


class Alone:
    """The system, its simulator and its context."""

    def __init__(self, system: LeafSystem, **inputs: Any) -> None:
        """The inputs by the names of their ports."""
        self.system, self.simulator = system, Simulator(system)
        self.context = self.simulator.get_mutable_context()
        for name, value in inputs.items():
            self.put(name, value)

    def put(self, name: str, value: Any) -> None:
        """Fix an input: a vector, or any other object."""
        fixed = value if isinstance(value, (list, np.ndarray)) else Value(value)
        self.system.GetInputPort(name).FixValue(self.context, fixed)

    def out(self, name: str) -> Any:
        """The output of that name."""
        return self.system.GetOutputPort(name).Eval(self.context)

    def advance(self, time: float) -> None:
        """Let a time pass, s."""
        self.simulator.AdvanceTo(self.context.get_time() + time)
