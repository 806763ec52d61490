"""The planner's state, and what a new goal resets of it."""

import dataclasses

import numpy as np

from drake_starnav.planning.guidance import Guidance
from drake_starnav.planning.parameters import PlannerParameters
from drake_starnav.planning.state import PlannerState, PlannerStatus
from tests.helpers.scans import RADIUS

INITIAL = PlannerState.initial(PlannerParameters(), RADIUS)
PATH = np.array(((1.0, 0.0), (2.0, 0.0)))


def test_before_the_first_scan_there_is_no_guidance() -> None:
    assert INITIAL.status is PlannerStatus.WAITING
    assert len(INITIAL.roadmap) == 0 and len(INITIAL.guidance.path) == 0


def test_the_guidance_is_the_path_and_whether_it_ends_at_the_goal() -> None:
    exploring = dataclasses.replace(INITIAL, path=PATH, status=PlannerStatus.EXPLORING)
    np.testing.assert_array_equal(exploring.guidance.path, PATH)
    approaching = dataclasses.replace(exploring, status=PlannerStatus.APPROACHING)
    assert exploring.guidance != approaching.guidance


def test_guidance_aside_precedes_the_path() -> None:
    other = Guidance(PATH + 1.0, False, INITIAL.roadmap.union)
    state = dataclasses.replace(INITIAL, path=PATH, aside=other)
    assert state.guidance is other
    assert state.with_new_goal().aside is None


def test_a_new_goal_keeps_the_map_and_resets_the_search() -> None:
    given_up = dataclasses.replace(INITIAL, path=PATH, status=PlannerStatus.UNREACHABLE, doubting=True, plans=7)
    after = given_up.with_new_goal()
    assert after.roadmap is given_up.roadmap and after.plans == 7
    assert after.status is PlannerStatus.WAITING and not after.doubting and len(after.path) == 0
