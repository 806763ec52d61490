"""A controller with its shield in a small diagram, whose inputs are fixed by hand."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder, LeafSystem

from drake_starnav.control import ControllerParameters

PERIOD = 1.0 / ControllerParameters().rate
"""Of the commands, s."""


class Controlling:
    """The diagram and its simulator."""

    def __init__(
        self,
        controller: LeafSystem,
        shield: LeafSystem,
        inputs: Mapping[str, Any],
        twist: tuple[float, float] = (0.0, 0.0),
    ) -> None:
        """The inputs by the names of their ports, and the twist that is commanded at first."""
        builder = DiagramBuilder()
        self.controller, self.shield = builder.AddSystem(controller), builder.AddSystem(shield)
        builder.Connect(controller.GetOutputPort("desired_twist"), shield.GetInputPort("desired_twist"))
        if controller.HasInputPort("twist_command"):
            builder.Connect(shield.GetOutputPort("twist_command"), controller.GetInputPort("twist_command"))
        self.diagram = builder.Build()
        self.simulator = Simulator(self.diagram)
        self.context = self.simulator.get_mutable_context()
        for name, value in inputs.items():
            self.put(name, value)
        shield.GetMyMutableContextFromRoot(self.context).SetDiscreteState(0, twist)

    def put(self, name: str, value: Any) -> None:
        """Fix an input of those that have it."""
        for system in (self.controller, self.shield):
            if system.HasInputPort(name):
                port = system.GetInputPort(name)
                port.FixValue(system.GetMyMutableContextFromRoot(self.context), value)

    def update(self, count: int = 1) -> np.ndarray:
        """The twist that is commanded after some periods."""
        # events at the end of a step are handled at the beginning of the next one
        self.simulator.AdvanceTo(self.context.get_time() + (count - 0.5) * PERIOD)
        twist = self.out("twist_command").copy()
        self.simulator.AdvanceTo(self.context.get_time() + 0.5 * PERIOD)
        return twist

    def out(self, name: str) -> Any:
        """The output of that name of one of both."""
        system = self.controller if self.controller.HasOutputPort(name) else self.shield
        return system.GetOutputPort(name).Eval(system.GetMyContextFromRoot(self.context))
