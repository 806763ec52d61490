"""A target whose probe stays hidden: when it is given up, and when it is looked at from nearer first."""

import dataclasses

import numpy as np
import pytest

from drake_starnav.planning import (
    PlannerInput,
    PlannerParameters,
    PlannerState,
    PlannerStatus,
    plan_step,
    recovery,
)
from drake_starnav.regions import Observation
from drake_starnav.regions.star_region import scan_region
from drake_starnav.worlds.world import World
from tests.helpers.scans import MARGINS, RADIUS, cast

pytestmark = pytest.mark.slow

PARAMETERS = PlannerParameters()
PERIOD = 0.05
POSE = np.array((1.0, 1.01, 0.0))


def door(width: float) -> list[list[tuple[float, float]]]:
    """A wall with a door of some width (m) about y = 1.01."""
    sides = (-1.0, 1.01 - 0.5 * width), (1.01 + 0.5 * width, 3.0)
    return [[(1.4, low), (1.6, low), (1.6, high), (1.4, high)] for low, high in sides]


DOOR = World(
    "door",
    (1.0, 1.01, 0.0),
    (4.0, 1.0),
    polygons=door(0.58),
    bounds=(-1.0, -1.0, 5.0, 3.0),
)
BESIDE_A_CORNER = np.array(((1.4, 1.01), (1.62, 0.9)))
"""A target in the door whose probe, and all within a cell of it, is nearer to a corner than radius and least margin."""


def tried(x: float, time: float, state: PlannerState) -> PlannerState:
    """The state after an update at (x, 1.01), on the way to the target beside a corner."""
    pose = np.array((x, 1.01, 0.0))
    scan = dataclasses.replace(cast(DOOR, pose), time=time)
    seen = Observation(scan_region(scan, pose, RADIUS, MARGINS), scan, pose)
    assert not seen.region.contains(BESIDE_A_CORNER[1])
    if len(state.roadmap):
        state = dataclasses.replace(state, target=BESIDE_A_CORNER, status=PlannerStatus.EXPLORING)
    return plan_step(state, PlannerInput(seen, pose[:2], np.array(DOOR.goal), time, PARAMETERS, MARGINS, RADIUS))


@pytest.mark.parametrize(
    ("detour", "blacklisted_targets"), [(recovery.INSPECTION_DETOUR, [0, 0, 0, 1]), (np.inf, [0, 1, 2, 3])]
)
def test_a_target_that_bars_much_is_given_up_only_at_its_stand(monkeypatch, detour, blacklisted_targets):
    monkeypatch.setattr(recovery, "INSPECTION_DETOUR", detour)
    state, found = PlannerState.initial(PARAMETERS, RADIUS), []
    for k, x in enumerate((1.0, 1.3, 1.33, 1.38)):
        state = tried(x, PERIOD * k, state)
        found.append(len(state.roadmap.blacklisted_targets))
    assert found == blacklisted_targets


@pytest.mark.parametrize("inspection_points", [False, True])
def test_what_a_passage_leaves_is_seen_at_any_look(inspection_points):
    """Only with less than the margin is the probe seen: a passage shows it at the first look as at the second."""
    x, probe = 1.38, np.array((1.75, 1.01))
    narrow = dataclasses.replace(DOOR, polygons=door(2.0 * (RADIUS + 0.02)))
    pose = np.array((x, 1.01, 0.0))
    scan = dataclasses.replace(cast(narrow, pose), time=PERIOD)
    whole = dataclasses.replace(MARGINS, least=MARGINS.preferred)
    for margins, given_up in ((MARGINS, False), (whole, inspection_points)):
        seen = Observation(scan_region(scan, pose, RADIUS, margins), scan, pose)
        start = Observation(scan_region(cast(narrow, POSE), POSE, RADIUS, margins), cast(narrow, POSE), POSE)
        state = PlannerState.initial(PARAMETERS, RADIUS)
        state = plan_step(state, PlannerInput(start, POSE[:2], np.array(DOOR.goal), 0.0, PARAMETERS, margins, RADIUS))
        roadmap = dataclasses.replace(
            state.roadmap, inspection_points=pose[None, :2] if inspection_points else np.zeros((0, 2))
        )
        target = np.array((pose[:2], probe))
        state = dataclasses.replace(state, roadmap=roadmap, target=target, status=PlannerStatus.EXPLORING)
        after = plan_step(state, PlannerInput(seen, pose[:2], np.array(DOOR.goal), PERIOD, PARAMETERS, margins, RADIUS))
        assert after.doubting == given_up
        assert bool(seen.region.contains(probe)) == (margins is MARGINS)
