"""The robot's body and limits."""

from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np

from drake_starnav.errors import StarnavError, shown
from drake_starnav.geometry.footprint import Footprint, disc, footprint
from drake_starnav.parameters import Checked, parameter
from drake_starnav.robot.base import Base
from drake_starnav.robot.car import Car
from drake_starnav.robot.differential import Differential
from drake_starnav.robot.limits import Limits
from drake_starnav.robot.omnidirectional import Omnidirectional

BASES: dict[str, Base] = {"differential": Differential(), "omnidirectional": Omnidirectional(), "car": Car()}
"""By the value of `robot.base`."""
LEAST_RADIUS, LARGEST_RADIUS = 0.01, 5.0
"""m"""
MODEL_FILES = (".urdf", ".xacro")
"""What the name of a robot's own file ends with."""


@dataclass(frozen=True)
class RobotParameters(Checked, place="robot"):
    """What a robot covers, how it moves, and what its drive can do."""

    model: str = parameter("starbot", "shipped robot by name, or a path to a URDF (docs/your_robot.md)")
    xacro_args: dict[str, Any] = field(
        default_factory=dict,
        metadata={
            "help": "arguments of a model in xacro: {name: value}, a text, a number, or true or false",
            "when": "the model declares some with <xacro:arg>",
        },
    )
    wheel_joints: tuple[str, str] = parameter(
        ("", ""), "joints of the left and the right wheel, several separated by spaces; empty: found by their axes"
    )
    overhangs: str = parameter(
        "",
        "links, separated by spaces, that may stick out of what it covers, as they swing above all that stands there",
        when="an arm or a mast above all obstacles",
    )
    radius: float = parameter(
        0.25,
        "radius of the disc that it covers; 0: what a shipped robot, or the collision shapes of a model of your own, "
        "cover, or the footprint's",
        unit="m",
        low=0.0,
        high=LARGEST_RADIUS,
        when="a round robot of another size",
    )
    footprint: list[Any] = field(
        default_factory=list,
        metadata={
            "help": "what it covers of the floor, if it is no disc: a convex polygon [[x, y], ...], m, x ahead, in the "
            "frame that it turns about; or a list of such polygons, of which it is the union",
            "when": "a robot that is no disc",
        },
    )
    base: str = parameter("differential", "how it moves", choices=tuple(BASES), when="it has other wheels")
    least_radius: float = parameter(
        0.5, "least radius of the circles that a base of kind car drives", unit="m", low=0.01, high=100.0
    )
    max_speed: float = parameter(
        0.8,
        "largest forward speed",
        unit="m/s",
        low=0.01,
        high=10.0,
        when="raise it together with the accelerations, see docs/tuning.md",
    )
    max_yaw_rate: float = parameter(2.0, "largest turning rate", unit="rad/s", low=0.01, high=20.0)
    max_acceleration: float = parameter(
        1.0,
        "largest rate at which the speed grows",
        unit="m/s^2",
        low=0.01,
        high=50.0,
        when="no more than the floor gives: the certificate trusts it to brake",
    )
    max_deceleration: float = parameter(
        0.0,
        "largest rate at which the speed falls; 0: max_acceleration",
        unit="m/s^2",
        low=0.0,
        high=50.0,
        when="the base brakes harder than it speeds up: the certificate then trusts it to, so no more than it does",
    )
    max_yaw_acceleration: float = parameter(4.0, "largest change of turning rate", unit="rad/s^2", low=0.01, high=200.0)
    mass_error: float = parameter(
        0.0, "by which share the simulated base is heavier than its model says", low=-0.9, high=10.0
    )

    def __post_init__(self) -> None:
        super().__post_init__()
        for name, value in self.xacro_args.items():
            if not isinstance(value, (str, int, float)):
                raise StarnavError(
                    f"robot.xacro_args.{name} is {shown(value)}; allowed: a text, a number, or true or false"
                )
        if not self.footprint:
            if 0.0 < self.radius < LEAST_RADIUS:
                raise StarnavError(f"robot.radius is {self.radius:g} m; allowed: 0, or at least {LEAST_RADIUS:g} m")
            return
        circumradius = self.shape.radius
        if circumradius > LARGEST_RADIUS:
            raise StarnavError(
                f"robot.footprint is {shown(self.footprint)} and reaches {circumradius:.4g} m from the robot's axis; "
                f"allowed: up to {LARGEST_RADIUS:g} m, with corners in metres"
            )
        if self.radius != RobotParameters.radius:
            self.check_beside(self.radius)
        object.__setattr__(self, "radius", circumradius)

    def check_beside(self, radius: Any) -> None:
        """Raise a `StarnavError` for a radius beside its footprint, but for 0 and the one that follows from it."""
        if radius not in (0.0, self.shape.radius):
            raise StarnavError(
                f"robot.radius is {shown(radius)} beside robot.footprint; allowed: one of them, the other taken back "
                f"by robot.radius=0 or robot.footprint=[], or the footprint's radius, {self.shape.radius!r} m"
            )

    @cached_property
    def shape(self) -> Footprint:
        """What it covers of the floor; `radius` is that of the disc which contains it.

        A disc of a base that cannot turn on the spot is a polygon, since it needs manoeuvres.

        Raises:
            StarnavError: `footprint` holds no convex polygons.
        """
        if not self.footprint and self.radius == 0.0:
            raise StarnavError(
                f"robot.radius is 0, and the shape of model {self.model} was not read; allowed: a scenario as from "
                "drake_starnav.load_scenario"
            )
        if not self.footprint:
            return self.body(disc(self.radius))
        try:
            return footprint(_tuples(self.footprint))
        except StarnavError as error:
            raise StarnavError(f"robot.{error}") from None
        except (IndexError, TypeError, ValueError):
            raise StarnavError(
                f"robot.footprint is {shown(self.footprint)}; allowed: [[x, y], ...], or a list of such lists, m"
            ) from None

    @property
    def said_of_shape(self) -> str:
        """What declares its shape, for messages."""
        return "robot.footprint" if self.footprint else f"robot.radius {self.radius:g} m"

    def body(self, shape: Footprint) -> Footprint:
        """A footprint as this robot is driven with it: of a base that cannot turn on the spot a polygon."""
        can_turn = self.drive.turns_on_the_spot or not shape.is_disc
        return shape if can_turn else footprint(_tuples(shape.outline.tolist()))

    @cached_property
    def limits(self) -> Limits:
        """Its speeds and accelerations; all floats, or kernels would be compiled again for whole numbers."""
        speed, acceleration = float(self.max_speed), float(self.max_acceleration)
        deceleration = float(self.max_deceleration) or acceleration
        turning, change = float(self.max_yaw_rate), float(self.max_yaw_acceleration)
        if self.drive.steers:  # at full speed its turning rate and acceleration are within the limits
            tightest = min(1.0 / self.least_radius, turning / speed)
            return Limits(speed, tightest, acceleration, deceleration, change / speed, 1.0)
        return Limits(speed, turning, acceleration, deceleration, change, 0.0, float(self.drive.holonomic))

    @property
    def drive(self) -> Base:
        """How it moves."""
        return BASES[self.base]

    @cached_property
    def motion_primitives(self) -> np.ndarray:
        """The motion primitives of its manoeuvres, see `Base.motion_primitives`."""
        return self.drive.motion_primitives(self.shape.radius, self.limits)


def _tuples(value: Any) -> Any:
    """A nested list as nested tuples."""
    return tuple(_tuples(part) for part in value) if isinstance(value, (list, tuple)) else value
