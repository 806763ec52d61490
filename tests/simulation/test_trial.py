"""What follows from a run."""

import numpy as np
import pytest

from drake_starnav import World, derive_margins, parse_scenario
from drake_starnav.simulation.trial import Run, is_goal_occupied
from drake_starnav.worlds.moving_obstacles import MovingObstacles

TOLERANCE, RADIUS = 0.1, 0.3


def occupied(away: float, *, footprint: str = "", goals: str = "", reached: int = 0) -> bool:
    """Whether a goal is occupied that a disc has stopped `away` from, m, to its right."""
    tolerance = f"simulation: {{goal_tolerance: {TOLERANCE}}}\n"
    text = f"world: !Room {{}}\nobstacles: {{max_speed: 1.0}}\n{tolerance}{footprint}{goals}"
    path = np.array([(0.0, 3.0, -away), (1.0, 3.0, -away)])
    world = World("test", (0.0, 0.0, 0.0), (3.0, 0.0), moving_obstacles=MovingObstacles(np.array([RADIUS]), (path,)))
    run = Run(5.0, np.zeros(1), np.zeros((1, 5)), np.zeros(1), np.zeros(1), goals=tuple(map(float, range(reached))))
    return is_goal_occupied(world, run, parse_scenario(text, name="test"))


BAR = "robot: {footprint: [[0.6, -0.2], [0.6, 0.2], [-0.6, 0.2], [-0.6, -0.2]]}\n"


@pytest.mark.parametrize(
    ("declared", "reach"),
    [
        ({}, 0.25),
        ({"footprint": BAR}, 0.2),  # lengthwise beside it
        ({"footprint": BAR, "goals": "goals: [[3, 0, 0.0]]\n"}, 0.2),
        ({"footprint": BAR, "goals": "goals: [[3, 0, 1.5708]]\n"}, 0.6),
        ({"footprint": BAR, "goals": "goals: [[9, 0], [3, 0, 1.5708]]\n", "reached": 1}, 0.6),
    ],
)
def test_a_goal_is_occupied_where_the_footprint_has_no_place_at_its_heading(declared, reach) -> None:
    margin = derive_margins(parse_scenario(f"world: !Room {{}}\n{declared.get('footprint', '')}", name="test")).safety
    last = RADIUS + reach + margin - TOLERANCE
    assert occupied(last - 0.05, **declared)
    assert not occupied(last + 0.005, **declared)
