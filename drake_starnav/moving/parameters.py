"""Parameters of seeing, tracking and avoiding obstacles that move."""

from dataclasses import dataclass

from drake_starnav.parameters import Checked, parameter


@dataclass(frozen=True)
class DynamicObstacleParameters(Checked, place="obstacles"):
    """Declared properties of moving obstacles, and how cautiously the robot treats them."""

    max_speed: float = parameter(
        0.0,
        "greatest speed of obstacles; 0: the world is static, and of this section only `min_width` is used",
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

    deceleration: float = parameter(
        0.0,
        "with which all obstacles can brake: a robot that drives also leaves them room to stop before they meet it; 0: "
        "it does not count on that",
        unit="m/s^2",
        low=0.0,
        high=100.0,
        when="where nobody must run into a standing robot either; the room is `max_speed^2 / (2 deceleration)`",
    )

    min_width: float = parameter(
        0.0,
        "width of the thinnest obstacle that must not be missed, be it standing or moving; 0: what two beams are "
        "apart where the robot must brake, or twice as much if lost beams or outliers are declared",
        unit="m",
        low=0.0,
        high=1.0,
        when="larger than what `starnav margins` prints, if nothing is so thin: lost beams then cost less speed; "
        "smaller where something is: the robot drives as slowly as it sees it",
    )

    @property
    def stopping_distance(self) -> float:
        """The room that the robot leaves obstacles to brake, m."""
        return self.max_speed**2 / (2.0 * self.deceleration) if self.deceleration > 0.0 else 0.0

    @property
    def guarded(self) -> bool:
        """Whether nothing is trusted: small obstacles may start to move, and hidden ones may emerge."""
        return self.caution == 1.0
