"""Parameters of seeing, tracking and avoiding obstacles that move."""

from dataclasses import dataclass

from drake_starnav.parameters import Checked, parameter


@dataclass(frozen=True)
class DynamicObstacleParameters(Checked, place="obstacles"):
    """Declared properties of moving obstacles, and how cautiously the robot treats them."""

    max_speed: float = parameter(
        0.0,
        "greatest speed of obstacles; 0: the world is static, and this section is not used",
        unit="m/s",
        low=0.0,
        high=10.0,
        when="set it where people or machines move, to the fastest of them",
    )
    max_radius: float = parameter(
        0.6,
        "radius of the largest; what is seen to be larger is static",
        unit="m",
        above=0.0,
        high=5.0,
        when="smaller, if all are: with `caution: 1` the robot keeps away from whatever may be one of them",
    )
    caution: float = parameter(
        0.5,
        "share of `max_speed` that the certificate allows for in all directions around a tracked obstacle; the rest is "
        "trusted to be its tracked motion. 1: no contact while driving, whatever obstacles do up to `max_speed`, even "
        "if they start to move or emerge from hiding",
        low=0.0,
        high=1.0,
        when="1 for the guarantee; less where being run into while standing is as bad as a collision",
    )

    @property
    def guarded(self) -> bool:
        """Whether nothing is trusted: small obstacles may start to move, and hidden ones may emerge."""
        return self.caution == 1.0
