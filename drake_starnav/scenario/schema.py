"""What a scenario holds.

A scenario has the sections `world, robot, lidar, localization, drive, planner, controller, obstacles, simulation,
recording`; each is a dataclass with defaults, so that a file only contains what differs.
`lidars` is a list of lidars, each of which has the values of `lidar` where it does not say otherwise. `goals` is a list
of [x, y] or [x, y, yaw], which the robot visits in order instead of the world's goal; at one with a yaw it turns to it.
`robots` is a list of robots: each a mapping over `robot` that also has a `start` [x, y, yaw], a `goal` or `goals`, and
may have a `name`, a `lidar` and `lidars`.
The world is chosen by a tag, e.g. `world: !Forest {width: 20}`; the models of a `!Model` may stand in `directives`.
`plant_config` and `simulator_config` hold what Drake's structs of these names hold. Faults of localization and drive
that are declared are simulated, and navigation allows for them; others are neither.
"""

import dataclasses
from dataclasses import dataclass, field
from typing import Any

from drake_starnav.control import ControllerParameters
from drake_starnav.errors import StarnavError, check_kind, shown
from drake_starnav.lidar.sensor_model import LidarParameters
from drake_starnav.moving.parameters import DynamicObstacleParameters
from drake_starnav.parameters import Checked, is_number, parameter
from drake_starnav.planning import PlannerParameters
from drake_starnav.robot import RobotParameters
from drake_starnav.safety import KeepOut, SpeedZone
from drake_starnav.worlds.world import check_numbers


@dataclass(frozen=True)
class LocalizationParameters(Checked, place="localization"):
    """How the believed pose of the robot differs from the true one."""

    drift: float = parameter(
        0.0,
        "error of the believed position as a share of the distance travelled, and of the heading as a share of the "
        "angle turned",
        low=0.0,
        high=0.5,
    )
    jump: float = parameter(0.0, "how far the believed position jumps at times", unit="m", low=0.0, high=5.0)
    jump_interval: float = parameter(10.0, "time from jump to jump", unit="s", low=0.1, high=1e6)
    matching: bool = parameter(
        True,
        "where the believed pose errs, new scans are aligned with old ones to correct it (methods that follow the "
        "planner's guidance)",
    )

    @property
    def exact(self) -> bool:
        """Whether the believed pose is the truth."""
        return self.drift == 0.0 and self.jump == 0.0


@dataclass(frozen=True)
class DriveParameters(Checked, place="drive"):
    """How the robot's motion differs from what is commanded."""

    delay: float = parameter(
        0.0, "time from a command to its effect, rounded up to whole plant steps", unit="s", low=0.0, high=1.0
    )
    error: float = parameter(
        0.0,
        "how much farther than the shipped robots the base strays from its commands until it stands",
        unit="m",
        low=0.0,
        high=0.5,
        when="for a base that does not follow its commands well; it widens the safety margin, and is not simulated",
    )
    slip: float = parameter(
        0.0, "largest share of its speed that a wheel loses; drawn again for each wheel every second", low=0.0, high=0.5
    )
    timeout: float = parameter(
        0.0,
        "after which a real base stops by itself when no command comes; 0: it does not, and a watchdog must",
        unit="s",
        low=0.0,
        high=10.0,
        when="it is driven by `drake_starnav.runtime`; not simulated",
    )


@dataclass(frozen=True)
class SimulationParameters:
    """How a trial is simulated and judged."""

    timeout: float = parameter(0.0, "time a trial may take; 0 for the world's own", unit="s", low=0.0, high=1e6)
    time_step: float = parameter(
        0.005,
        "step of a discrete plant; the delay of a drive is rounded up to a multiple of it",
        unit="s",
        low=1e-4,
        high=0.02,
    )
    goal_tolerance: float = parameter(
        0.3, "distance from the goal at which it counts as reached", unit="m", above=0.0, high=10.0
    )


@dataclass(frozen=True)
class RecordingParameters:
    """How a run is recorded and drawn."""

    frames_per_second: int = parameter(
        20, "frames of the animation; fewer make a smaller file", unit="1/s", low=1, high=120
    )
    scan_rate: float = parameter(
        5.0, "scans, paths and certificates that are drawn; fewer make a smaller file", unit="Hz", low=0.1, high=100.0
    )


@dataclass(frozen=True)
class Scenario:
    """Everything that, with a seed, defines a trial.

    Its fields are the sections of docs/parameters.md. `lidars` are those of a robot that has several; the first of
    them is `lidar`. `goals` are (x, y) or (x, y, yaw), W, m and rad; without any, the robot drives to the goal of its
    world. `robots` are scenarios of one robot each, which share a world and have a `start`, (x, y, yaw). `zones` are
    the areas that it must stay out of, and those in which it must be slow. `method` is the name of the one that it was
    loaded with, as reports show it.
    """

    name: str
    world: Any
    robot: RobotParameters = field(default_factory=RobotParameters)
    lidar: LidarParameters = field(default_factory=LidarParameters)
    localization: LocalizationParameters = field(default_factory=LocalizationParameters)
    drive: DriveParameters = field(default_factory=DriveParameters)
    planner: PlannerParameters = field(default_factory=PlannerParameters)
    controller: ControllerParameters = field(default_factory=ControllerParameters)
    obstacles: DynamicObstacleParameters = field(default_factory=DynamicObstacleParameters)
    simulation: SimulationParameters = field(default_factory=SimulationParameters)
    recording: RecordingParameters = field(default_factory=RecordingParameters)
    plant_config: dict[str, Any] = field(default_factory=dict)
    simulator_config: dict[str, Any] = field(default_factory=dict)
    lidars: tuple[LidarParameters, ...] = ()
    goals: tuple[tuple[float, ...], ...] = ()
    start: tuple[float, float, float] | None = None
    robots: tuple["Scenario", ...] = ()
    zones: tuple[KeepOut | SpeedZone, ...] = ()
    method: str = field(default="star", compare=False)

    def __post_init__(self) -> None:
        for k, goal in enumerate(self.goals):
            if len(goal) not in (2, 3) or not all(map(is_number, goal)):
                raise StarnavError(f"goals[{k}] is {shown(list(goal))}; allowed: finite [x, y] or [x, y, yaw]")
            check_numbers(goal, f"goals[{k}]", ("x", "y", "yaw")[: len(goal)])
        if self.lidars and self.lidar != self.lidars[0]:
            raise StarnavError("lidar differs from lidars[0]; allowed: the same, or lidars alone")
        first, others = self.all_lidars[0], self.all_lidars[1:]
        for k, other in enumerate(others, start=1):
            if other.delay != first.delay:
                raise StarnavError(
                    f"lidars[{k}].delay is {other.delay:g}, lidars[0].delay {first.delay:g}; allowed: the same, as a "
                    "scan comes with the pose at its time"
                )

    @property
    def all_lidars(self) -> tuple[LidarParameters, ...]:
        """The robot's lidars: `lidars`, or the one `lidar`."""
        return self.lidars or (self.lidar,)


DRAKE_CONFIGS = ("plant_config", "simulator_config")
"""Sections with the keys of Drake's `MultibodyPlantConfig` and `SimulatorConfig`; see `station.plant`."""
LISTS = ("lidars", "goals", "robots", "zones")
"""Keys that hold lists."""
SECTIONS: dict[str, Any] = {
    part.name: part.default_factory
    for part in dataclasses.fields(Scenario)
    if part.name not in ("name", "world", "start", "method", *LISTS, *DRAKE_CONFIGS)
}
KEYS = ("world", *SECTIONS, *LISTS, *DRAKE_CONFIGS)
"""Keys of a scenario that may be overridden; it may also hold `directives`."""


def check_method(scenario: Scenario, method: str | None) -> str:
    """The method, or where it is None that of the scenario; a `StarnavError` if the scenario is of another."""
    check_kind(scenario, Scenario, "scenario", "as from load_scenario")
    if method not in (None, scenario.method):
        raise StarnavError(
            f"method is {method}, and the scenario was loaded with {scenario.method}; allowed: that, or a scenario of "
            f"load_scenario(..., method={method!r})"
        )
    return scenario.method


def check_plain_robot(scenario: Scenario) -> None:
    """Raise a `StarnavError` for what methods as published do not do: other bases, goals with a heading."""
    if scenario.robot.base != "differential":
        raise StarnavError(
            f"method {scenario.method} with robot.base {scenario.robot.base}; allowed: star, or a differential drive"
        )
    for k, goal in enumerate(scenario.goals):
        if len(goal) == 3:
            raise StarnavError(
                f"goals[{k}] has a yaw with method {scenario.method}, which follows no turns on the spot; "
                "allowed: [x, y]"
            )


def select_world(scenario: Scenario, number: int | None) -> Scenario:
    """The scenario in the world of that number, for kinds of numbered worlds; as it is where the number is None."""
    if number is None:
        return scenario
    return dataclasses.replace(scenario, world=dataclasses.replace(scenario.world, id=number))
