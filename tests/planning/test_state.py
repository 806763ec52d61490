"""The planner's state, what a new goal resets of it, and the guidance."""

import dataclasses

import numpy as np
import pytest

from drake_starnav.errors import StarnavError
from drake_starnav.planning.guidance import Guidance
from drake_starnav.planning.parameters import PlannerParameters
from drake_starnav.planning.state import ManoeuvreState, PlannerState, PlannerStatus, Progress, Route
from drake_starnav.surroundings import Observation
from tests.helpers.scans import RADIUS

INITIAL = PlannerState.initial(PlannerParameters(), RADIUS)
PATH = np.array(((1.0, 0.0), (2.0, 0.0)))


def test_a_turn_to_unseen_space_precedes_the_path() -> None:
    seen = dataclasses.replace(Observation.none(), pose=np.array((0.5, 0.2, 0.1)))
    state = dataclasses.replace(
        INITIAL, route=Route(PATH), recent_observations=(seen,), progress=Progress(looking_heading=1.5)
    )
    np.testing.assert_array_equal(state.guidance.poses, [(0.5, 0.2, 1.5, 0.0)])
    assert not len(state.with_new_goal().guidance.poses)


def test_a_new_goal_keeps_the_map_and_resets_the_search() -> None:
    progress = Progress(plan_count=7)
    given_up = dataclasses.replace(
        INITIAL,
        route=Route(PATH, beyond=PATH),
        status=PlannerStatus.UNREACHABLE,
        is_retrying=True,
        progress=progress,
        manoeuvre=ManoeuvreState(poses=np.zeros((1, 4)), has_given_up=True),
    )
    after = given_up.with_new_goal()
    assert after.roadmap is given_up.roadmap and after.progress.plan_count == 7
    assert after.status is PlannerStatus.WAITING and not after.is_retrying
    assert not len(after.route.beyond) and after.route.exit is None, "nothing of the old way fails"
    assert not len(after.manoeuvre.poses) and not after.manoeuvre.has_given_up, "or is driven"


def test_a_path_is_followed_to_its_end() -> None:
    guidance = Guidance.along([(1.0, 0.0), (1.0, 2.0)])
    assert guidance.arrives and guidance.path.tolist() == [[1.0, 0.0], [1.0, 2.0]]
    assert len(Guidance.along([]).path) == 0


@pytest.mark.parametrize("path", [[(1.0, 2.0, 0.5)], [1.0, 2.0], [(1.0, float("nan"))], np.zeros((2, 2, 2))])
def test_an_invalid_path_is_rejected(path) -> None:
    with pytest.raises(StarnavError, match=r"guidance: path has shape .*; allowed: \(k, 2\), finite x and y"):
        Guidance.along(path)
