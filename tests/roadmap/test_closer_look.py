"""A target whose probe stays hidden: when it is given up, and when it is looked at from nearer first."""

import dataclasses

import numpy as np
import pytest

from drake_starnav.roadmap import Observation, PlannerInput, PlannerParameters, PlannerState, PlannerStatus, plan_step
from drake_starnav.stars.region import scan_region
from drake_starnav.worlds.world import World
from tests.scans import RADIUS, cast

PARAMETERS = PlannerParameters()
PERIOD = 0.05
DOOR = World(
    "door",
    (1.0, 1.01, 0.0),
    (4.0, 1.0),
    polygons=[[(1.4, low), (1.6, low), (1.6, high), (1.4, high)] for low, high in ((-1.0, 0.7), (1.32, 3.0))],
    bounds=(-1.0, -1.0, 5.0, 3.0),
)
BESIDE_A_CORNER = np.array(((1.4, 1.01), (1.7, 0.95)))
"""A target in the door whose probe is nearer to a corner than the radius and the margin."""


def tried(x: float, time: float, state: PlannerState, parameters: PlannerParameters) -> PlannerState:
    """The state after an update at (x, 1.01), on the way to the target beside a corner."""
    pose = np.array((x, 1.01, 0.0))
    scan = dataclasses.replace(cast(DOOR, pose), time=time)
    seen = Observation(scan_region(scan, pose, RADIUS, parameters), scan, pose)
    assert not seen.region.contains(BESIDE_A_CORNER[1])
    if len(state.roadmap):
        state = dataclasses.replace(state, target=BESIDE_A_CORNER, status=PlannerStatus.EXPLORING)
    return plan_step(state, PlannerInput(seen, pose[:2], np.array(DOOR.goal), time, parameters, RADIUS))


@pytest.mark.parametrize(("closer_look", "retired"), [(PARAMETERS.closer_look, [0, 0, 0, 1]), (20.0, [0, 1, 2, 3])])
def test_a_target_that_bars_much_is_given_up_only_at_its_stand(closer_look, retired):
    parameters = dataclasses.replace(PARAMETERS, closer_look=closer_look, margin_shrinking=False)
    state, found = PlannerState.initial(parameters, RADIUS), []
    for k, x in enumerate((1.0, 1.3, 1.33, 1.38)):
        state = tried(x, PERIOD * k, state, parameters)
        found.append(len(state.roadmap.retired))
    assert found == retired


def test_less_margin_is_tried_only_before_a_closer_look():
    start = tried(1.0, 0.0, PlannerState.initial(PARAMETERS, RADIUS), PARAMETERS)
    first = tried(1.38, PERIOD, start, PARAMETERS)
    assert not len(first.roadmap.retired) and first.roadmap.regions[-1].margin < PARAMETERS.margin
    looked = dataclasses.replace(start.roadmap, looked=np.array(((1.3, 1.01),)))
    closer = tried(1.38, PERIOD, dataclasses.replace(start, roadmap=looked), PARAMETERS)
    assert len(closer.roadmap.retired) == 1 and closer.roadmap.regions[-1].margin == PARAMETERS.margin
