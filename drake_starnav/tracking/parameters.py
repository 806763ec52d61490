"""Parameters of seeing, tracking and avoiding obstacles that move."""

from dataclasses import dataclass

from drake_starnav.parameters import check_parameters, parameter


@dataclass(frozen=True)
class DynamicObstacleParameters:
    """Declared properties of moving obstacles, and how cautiously the robot treats them."""

    max_speed: float = parameter(
        0.0,
        "greatest speed of obstacles; 0: the world stands still, and nothing of this section is in use",
        unit="m/s",
        low=0.0,
        high=10.0,
        when="set it where people or machines move, to the fastest of them",
    )
    max_radius: float = parameter(
        0.6,
        "radius of the largest; what is seen to be larger stays where it is",
        unit="m",
        above=0.0,
        high=5.0,
        when="smaller, with `caution: 1`, where all that moves is: the robot keeps away from what might be such a one",
    )
    caution: float = parameter(
        0.5,
        "which share of `max_speed` the certificate counts with in all directions for what is tracked; the rest is "
        "trusted to be its tracked motion. 1: no contact while driving, whatever it does: then what stands may start, "
        "and what is hidden come out, at `max_speed`",
        low=0.0,
        high=1.0,
        when="1 for the guarantee; less where being run into while standing is as bad as running into something",
    )

    @property
    def guarded(self) -> bool:
        """Whether nothing is trusted: small obstacles may start to move, and hidden ones may emerge."""
        return self.caution == 1.0

    def __post_init__(self) -> None:
        check_parameters(self, "obstacles")
