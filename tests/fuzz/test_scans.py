"""Whatever a scan holds, it is refused in one sentence, or perceived without certifying what it did not see."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from drake_starnav.errors import StarnavError
from drake_starnav.lidar.laser_scan import LaserScan
from drake_starnav.lidar.outlier_filter import HitHistory, remove_outliers
from drake_starnav.planning import PlannerInput, PlannerParameters, PlannerState, plan_step
from drake_starnav.surroundings import Observation
from drake_starnav.surroundings.scan_averaging import average_scan
from drake_starnav.surroundings.star_region import make_scan_region
from drake_starnav.utils.snapshot import replace_fields
from tests.helpers.scans import MARGINS, RADIUS, observe_scan

PARAMETERS = PlannerParameters()
fuzzed = settings(max_examples=60, deadline=None)
numbers = st.one_of(st.floats(), st.floats(-1.0, 7.0))
arrays = hnp.arrays(float, hnp.array_shapes(max_dims=2, max_side=40), elements=numbers)
ranges = hnp.arrays(
    float, 36, elements=st.one_of(st.floats(0.0, 4.0), st.sampled_from([np.inf, -np.inf, np.nan, 0.0, 4.0, -1.0]))
)


@fuzzed
@given(numbers, numbers, numbers, numbers, numbers, arrays, numbers, numbers)
def test_any_fields_make_a_scan_or_are_refused(time, start, step, low, high, found, increment, period):
    try:
        scan = LaserScan(time, start, step, low, high, found, increment, period)
    except StarnavError as error:
        assert "allowed" in str(error)
        return
    assert np.isfinite(scan.distances).all() and scan.distances.min() >= 0.0
    assert scan.points().shape == (scan.hits.sum(), 2)


@fuzzed
@given(ranges, st.tuples(st.floats(-9.0, 9.0), st.floats(-9.0, 9.0), st.floats(-9.0, 9.0)))
def test_any_ranges_are_perceived(found, pose):
    pose = np.array(pose)
    scan = LaserScan(0.0, -np.pi, 2.0 * np.pi / 36, 0.0, 4.0, found, lost_beams=True)
    scan = remove_outliers(scan, pose, HitHistory((scan.points(pose)[::2],)))[0]
    region = make_scan_region(scan, pose, RADIUS, MARGINS)
    seen = observe_scan(scan, pose, RADIUS, 1.2)
    recent_hits, mean = average_scan(seen.recent_hits, scan, pose + 0.01, 1.0)
    averaged = observe_scan(mean, pose + 0.01, RADIUS, 1.2, replace_fields(seen, recent_hits=recent_hits))
    star = seen.certified_star
    for values in (region.boundary.values, star.values, averaged.certified_star.values):
        assert np.isfinite(values).all() and values.min() >= 0.0
    samples = np.arange(36) * len(star.values) // 36
    assert (star.values[samples] <= np.maximum(scan.distances - RADIUS, 0.0) + 1e-9).all()
    observation = Observation(region, scan, pose)
    state = PlannerState.initial(PARAMETERS, RADIUS)
    for time in (0.0, 0.1):
        state = plan_step(state, PlannerInput(observation, pose[:2], np.zeros(2), time, PARAMETERS, MARGINS, RADIUS))
    assert np.isfinite(state.route.path).all()
