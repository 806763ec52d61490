"""A scenario as one built diagram."""

from pydrake.systems.framework import Diagram, DiagramBuilder

from drake_starnav.navigation.parts import AS_DECLARED, Parts
from drake_starnav.navigation.wiring import add_navigation
from drake_starnav.scenario.schema import Scenario
from drake_starnav.station.navigation_station import list_station_outputs
from drake_starnav.station.plant import make_simulator_config
from drake_starnav.systems.connecting import list_outputs


class NavigationDiagram(Diagram):
    """The diagram of a scenario, see `make_diagram`.

    Attributes:
        navigation: the systems in it.
        simulator_config: the scenario's, for `make_simulator`.
    """

    def __init__(self, scenario: Scenario, parts: Parts, seed: int) -> None:
        """Build it; the arguments are those of `make_diagram`."""
        super().__init__()
        make_simulator_config(scenario.simulator_config)  # refused before it is used
        self.simulator_config = scenario.simulator_config
        builder = DiagramBuilder()
        self.navigation = add_navigation(builder, scenario, parts, seed)
        for name in ("planner", "matcher", "controller", "shield"):
            system = getattr(self.navigation, name)
            for port_name, port in ({} if system is None else list_outputs(system)).items():
                builder.ExportOutput(port, f"{name}.{port_name}")
        station = self.navigation.station
        for name in list_station_outputs(len(station.mounts)):
            builder.ExportOutput(station.GetOutputPort(name), name)
        builder.BuildInto(self)
        self.set_name(scenario.name)


def make_diagram(scenario: Scenario, parts: Parts = AS_DECLARED, seed: int = 0) -> NavigationDiagram:
    """The built diagram of a scenario: simulate it, or add it to a builder of your own.

    Any simulator steps it; `make_simulator` also applies the scenario's `simulator_config`. It exports the outputs of
    planner, controller, shield and station under dotted names: `planner.guidance`, `planner.short_term_goal`,
    `planner.planner_state`, `planner.status`, `planner.blocked_by` (if there is a planner), `controller.desired_twist`,
    `controller.guiding_vector`, `shield.twist_command`, `shield.certificate`, and all of the station's; if the scenario
    declares that the believed pose errs, also `matcher.pose` and the others of the matcher.

    Args:
        parts: of your own; but no station, which is part of the diagram.
        seed: of the world and of the sensor's noise.
    """
    return NavigationDiagram(scenario, parts, seed)
