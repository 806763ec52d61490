"""Who stands on the goal or in the only door, and may leave, is waited for."""

import math

import numpy as np
import pytest

from drake_starnav import Parts, World, parse_scenario, run_trial
from drake_starnav.worlds.moving_obstacles import MovingObstacles

BOUNDS, GOAL = (-1.0, -2.0, 6.0, 2.0), (4.0, 0.0)
DOOR = [[(2.0, -2.0), (2.2, -2.0), (2.2, -0.55), (2.0, -0.55)], [(2.0, 0.55), (2.2, 0.55), (2.2, 2.0), (2.0, 2.0)]]
PLACES = {"goal": (GOAL, (2.2, 1.6), []), "door": ((2.1, 0.0), (5.4, 1.4), DOOR)}
"""Where the person stands, and where it walks, which is not past the robot; and the walls."""


def room(where: str, leaves: float, radius: float = 0.3) -> World:
    """A room in which a person stands, and then walks aside."""
    place, aside, walls = PLACES[where]
    walked = leaves + math.dist(place, aside) / 0.7
    path = np.array([(0.0, *place), (leaves, *place), (walked, *aside), (400.0, *aside)])
    person = MovingObstacles(np.array([radius]), (path,))
    return World("room", (0, -0.5, 0), GOAL, bounds=BOUNDS, polygons=walls, timeout=150.0, moving_obstacles=person)


def declaring(caution: float, patience: float = 0.0, max_radius: float = 0.4):
    return parse_scenario(
        f"obstacles: {{max_speed: 0.8, max_radius: {max_radius}, caution: {caution}}}\n"
        f"planner: {{obstacle_patience: {patience}}}",
        name="waiting",
    )


@pytest.mark.slow
@pytest.mark.parametrize("where", PLACES)
@pytest.mark.parametrize(("leaves", "caution"), [(20.0, 0.0), (20.0, 1.0), (60.0, 0.5)])
def test_it_arrives_soon_after_a_person_has_left(where: str, leaves: float, caution: float) -> None:
    trial = run_trial(declaring(caution), Parts(room(where, leaves)), seed=1)
    assert trial.outcome == "reached" and trial.time_s is not None
    assert leaves < trial.time_s < leaves + 15.0


def test_it_gives_up_who_does_not_leave_in_time_and_says_so() -> None:
    trial = run_trial(declaring(0.5, patience=10.0), Parts(room("door", 100.0)), seed=1)
    assert trial.outcome in ("unreachable", "occupied")
    assert "an obstacle that may move, for which the robot has waited 10 s" in (trial.blocked_by or "")
    assert trial.time_s is None or trial.time_s < 40.0


def test_what_is_too_large_to_be_one_of_them_is_not_waited_for() -> None:
    trial = run_trial(declaring(0.5, max_radius=0.1), Parts(room("door", 100.0)), seed=1)
    assert trial.outcome == "unreachable"
