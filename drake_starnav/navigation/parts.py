"""What a navigation loop consists of, and what of it may be the user's own."""

import dataclasses
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from pydrake.systems.framework import Context, OutputPort, PortDataType, System

from drake_starnav.control.inputs import Propose
from drake_starnav.errors import StarnavError, check_kind, shown
from drake_starnav.navigation.robot import Robot
from drake_starnav.parameters import unknown_name
from drake_starnav.planning.state import PlanStep
from drake_starnav.safety.certificates import Certificate
from drake_starnav.scenario.schema import Scenario
from drake_starnav.scenario.shipped import import_method
from drake_starnav.station.navigation_station import StationInterface
from drake_starnav.surroundings.perception import Perceive
from drake_starnav.systems.connecting import find_output_port, list_outputs
from drake_starnav.systems.obstacle_tracker import ObstacleTracker
from drake_starnav.systems.scan_matcher import ScanMatcher
from drake_starnav.worlds.world import World


@dataclass(frozen=True)
class Parts:
    """Parts of a navigation loop of your own, in the place of those of its scenario.

    A planner or controller is wired by the names of its ports. Inputs are `scan`, `ranges`, `scan_pose`, `pose`,
    `state`, `goal`, `heading` of a `GoalSequence`, `observation`, `surroundings` and `tracks`, as of the systems
    that output them; for a controller also `twist_command`, which is driven now, the planner's outputs,
    `short_term_goal`, `guidance` and all others, and `world`, the `World` driven through, for one that may know it.
    Inputs that are connected already stay so. Each system serves for one diagram.

    Attributes:
        world: in which to drive.
        station: already in the builder, instead of a `NavigationStation`: any `Robot`, as by `add_station`, the
            `RobotInterface` of one of several robots in a plant, or one without a plant.
        goal: whose output `goal`, or only one, is (x, y) in W, m, instead of the scenario's goals and the world's; in
            the builder already, or not.
        perception: instead of ours; it outputs `observation` and `surroundings`.
        planner: instead of the star roadmap; it outputs `guidance`, or what your controller reads.
        controller: instead of the scenario's; it outputs `desired_twist`, (v, omega), m/s and rad/s.
            In the place of these three systems may stand the pure function that ours runs: a `Perceive`, a `PlanStep`,
            a `Propose`.
        shield: instead of a `TwistShield`, e.g. an `Unshielded`, for which no guarantee holds.
        certificates: each of which must accept what is driven, too; for the scenario's shield.
        certified: False: the shield only keeps the robot's limits, what moves is not tracked, and a controller of your
            own that reads nothing of perception and planner drives without them.
    """

    world: World | None = None
    station: Robot | None = None
    goal: System | None = None
    perception: System | Perceive | None = None
    planner: System | PlanStep | None = None
    controller: System | Propose | None = None
    shield: System | None = None
    certificates: tuple[Certificate, ...] = ()
    certified: bool = True

    def __post_init__(self) -> None:
        if self.world is not None:
            check_kind(self.world, World, "world", "as from make_world")
        if self.station is not None and not all(hasattr(self.station, name) for name in ("scenario", "mounts")):
            raise StarnavError(f"station is {shown(self.station)}; allowed: a Robot, which has scenario and mounts")
        if not isinstance(self.certificates, (tuple, list)):
            raise StarnavError(f"certificates is {shown(self.certificates)}; allowed: a list of certificates")
        object.__setattr__(self, "certificates", tuple(self.certificates))

    def of_method(self, scenario: Scenario) -> "Parts":
        """Return these parts, completed by those of the scenario's method; see `METHODS`.

        Raises:
            StarnavError: both have one part, or the method returns no parts.
        """
        make = import_method(scenario.method)
        if make is None:
            return self
        made_parts = make(scenario)
        made_parts = Parts(controller=made_parts) if isinstance(made_parts, System) else made_parts
        made_parts = Parts(**made_parts) if isinstance(made_parts, Mapping) else made_parts
        check_kind(made_parts, Parts, f"what method {scenario.method} returns", "or a controller")
        given_parts = {field.name: getattr(self, field.name) for field in dataclasses.fields(self)}
        given_parts = {name: part for name, part in given_parts.items() if part not in (None, (), True)}
        for name in given_parts.keys() - {"certified"}:
            if getattr(made_parts, name) not in (None, (), True):
                raise StarnavError(
                    f"method {scenario.method} has a {name}, and you have one of your own; allowed: one of them"
                )
        return dataclasses.replace(made_parts, **given_parts)


def find_function(part: Any) -> Any:
    """Return the part if it is a pure function that a system of ours runs, else None."""
    return part if callable(part) and not isinstance(part, (System, type)) else None


AS_DECLARED = Parts()
"""Nothing of the user's own: all is as the scenario declares it."""


@dataclass(frozen=True)
class Navigation:
    """The systems of a navigation loop in a builder, for connecting more to them and for recording them.

    `add_navigation` makes one. For a loop wired by hand, make a `Navigation` of the world, the station and whichever of
    the other systems exist; `Recorder` draws those.

    Attributes:
        world: driven through.
        station: robot and sensor.
        goal: its output `goal`, or only one, is the goal.
        perception: None for a lone controller, not certified, that reads nothing of it.
        planner: None for such a controller.
        controller: proposes the twist.
        tracker: if the scenario declares obstacles that move.
        matcher: if it declares that the believed pose errs.
        shield: decides what of it is driven.
    """

    world: World
    station: Robot
    goal: System | None = None
    perception: System | None = None
    planner: System | None = None
    controller: System | None = None
    tracker: ObstacleTracker | None = None
    matcher: ScanMatcher | None = None
    shield: System | None = None

    def read(self, name: str, root: Context) -> Any:
        """What is sent now under a name of `signals`, or as `twist_command` or `certificate`.

        Args:
            name: e.g. "state", "goal", "scan", "guidance", "status"; docs/ports.md has what each holds.
            root: the context of the whole diagram, as `simulator.get_context()`.

        Raises:
            StarnavError: there is none of that name here.
        """
        ports = self.signals | {"twist_command": self.twist_command, "certificate": self.certificate}
        ports = {port_name: port for port_name, port in ports.items() if port is not None}
        if name not in ports:
            raise unknown_name(f"signal {shown(name)}", name, ports)
        return ports[name].Eval(ports[name].get_system().GetMyContextFromRoot(root))

    @property
    def signals(self) -> dict[str, OutputPort]:
        """What a planner or controller of the user's may read, by the name of its input port, all in one frame."""
        signals = {name: self.localization(name) for name in ("pose", "state", "scan_pose")}
        signals["scan"] = self.station.GetOutputPort("lidar.scan")
        if isinstance(self.station, StationInterface):
            signals["ranges"] = self.station.GetOutputPort("lidar.ranges")
        if self.goal is not None:
            signals["goal"] = self.goal_position
            signals |= {name: port for name, port in list_outputs(self.goal).items() if name == "heading"}
        if self.perception is not None:
            perception = self.matcher or self.perception
            signals |= {name: perception.GetOutputPort(name) for name in ("observation", "surroundings")}
        if self.matcher is None and self.tracker is not None:  # else they are in the frame of the odometry
            signals["tracks"] = self.tracker.GetOutputPort("tracks")
        return signals if self.planner is None else list_outputs(self.planner) | signals

    def localization(self, name: str) -> OutputPort:
        """The port `pose`, `state` or `scan_pose` in the world frame of planner and goal."""
        if self.matcher is not None:
            return self.matcher.GetOutputPort(name)
        return self.station.GetOutputPort(f"localization.{name}")

    @property
    def goal_position(self) -> OutputPort:
        """The port of the goal, (x, y) in W, m."""
        if self.goal is None:
            raise StarnavError("the navigation has no goal; allowed: one, as a FixedGoal")
        return find_output_port(self.goal, "goal", 2, "goal")

    def planned(self, name: str, kind: type | None = None) -> OutputPort | None:
        """The planner's port of a name; None without a planner, or of one that has no such port, or not of a kind."""
        port = None if self.planner is None else list_outputs(self.planner).get(name)
        if port is None or kind is None:
            return port
        abstract = port.get_data_type() == PortDataType.kAbstractValued
        return port if abstract and isinstance(port.Allocate().get_value(), kind) else None

    @property
    def certificate(self) -> OutputPort | None:
        """The port of the certificate, in the same frame; None of a shield that has no such port."""
        if self.shield is None or "certificate" not in list_outputs(self.shield):
            return None
        return (self.matcher or self.shield).GetOutputPort("certificate")

    @property
    def twist_command(self) -> OutputPort | None:
        """The port of the twist that is driven; None without a shield."""
        return (
            None if self.shield is None else find_output_port(self.shield, "twist_command", self.twist_size, "shield")
        )

    @property
    def twist_size(self) -> int:
        """Number of components of the robot's twists."""
        return len(self.station.scenario.robot.drive.components)
