"""Parameters of the controller."""

from dataclasses import dataclass

from drake_starnav.errors import StarnavError
from drake_starnav.parameters import check_parameters, parameter
from drake_starnav.regions.parameters import SafetyParameters

CERTIFIED = ("star", "mpc")
"""Kinds of controllers that certify what they send."""
GUIDED = (*CERTIFIED, "star_paper")
"""Kinds of controllers that follow the planner's guidance; the others are baselines that head for the goal alone."""


@dataclass(frozen=True)
class ControllerParameters(SafetyParameters):
    """How guidance becomes a twist, and what certifies it."""

    kind: str = parameter(
        "star",
        "star (follow the guiding vector), mpc (choose among sampled twists by where they lead), star_paper (with a "
        "perception and a planner of its own, which use none of what follows but rate), or a baseline to compare with "
        "(docs/baselines.md), which uses rate, target, heading_gain and goal_slowdown of this section and the section "
        "of its own name",
        choices=("star", "mpc", "star_paper", "dsm", "foa", "dwa", "apf"),
    )
    target: str = parameter(
        "goal",
        "what a baseline heads for: the goal, or the short-term goals of the star roadmap",
        choices=("goal", "short_term_goal"),
    )
    rate: float = parameter(50.0, "commands a second", unit="Hz", low=0.1, high=1000.0)
    heading_gain: float = parameter(
        4.0,
        "turning rate per heading error",
        unit="1/s",
        above=0.0,
        high=50.0,
        when="lower it if the robot sways about its path",
    )
    goal_slowdown: float = parameter(
        1.2, "speed per metre of distance to the goal on arrival", unit="1/s", above=0.0, high=50.0
    )
    horizon: float = parameter(1.5, "how far ahead the predictive law looks", unit="s", above=0.0, high=10.0)
    prediction_step: float = parameter(0.1, "step of the foreseen motion", unit="s", low=0.01, high=1.0)
    prediction_hold: float = parameter(
        0.3, "how long a sampled twist is held before the path is followed", unit="s", above=0.0, high=10.0
    )
    speed_samples: int = parameter(5, "sampled speeds from 0 to the largest", low=2, high=50)
    turn_samples: int = parameter(11, "sampled turning rates, denser near 0", low=3, high=100)
    clearance_zone: float = parameter(
        0.1, "clearance below which the predictive law counts a metre as longer", unit="m", above=0.0, high=2.0
    )
    clearance_weight: float = parameter(
        0.9,
        "how much longer a metre right at an obstacle counts; below 1, or standing may seem better than passing",
        low=0.0,
        high=10.0,
    )
    change_weight: float = parameter(
        0.15, "what a change of speed or turning rate by its whole range costs", unit="s", low=0.0, high=10.0
    )
    free_heading_range: float = parameter(
        0.8,
        "largest turn of the guiding vector to the nearest bearing that the safety star leaves open, where it leaves "
        "no way along the vector; 0: none",
        unit="rad",
        low=0.0,
        high=3.2,
    )
    scan_patience: float = parameter(
        3.0,
        "scan periods (beyond the lidar's declared delay) without a new scan after which the robot brakes",
        low=1.0,
        high=1000.0,
    )
    delay: float = parameter(
        0.0,
        "time from a command to its effect, at most one control period; the certificate allows for it",
        unit="s",
        low=0.0,
        high=1.0,
        when="for a controller wired by hand; else declare drive.delay",
    )

    def __post_init__(self) -> None:
        check_parameters(self, "controller")
        if self.delay > 1.0 / self.rate:
            raise StarnavError(
                f"controller.delay is {self.delay:g} s; allowed: at most one control period, {1.0 / self.rate:g} s"
            )

    @property
    def certifies(self) -> bool:
        """Whether its twists are certified."""
        return self.kind in CERTIFIED
