"""The separation is a lower bound of the distance, and decides contact."""

import math

import numpy as np
import shapely

from drake_starnav.geometry.footprint import covered, footprint
from drake_starnav.regions.chords import Chords
from drake_starnav.regions.separation import separation

ELL = footprint(
    (
        ((-0.3, -0.125), (0.3, -0.125), (0.3, 0.125), (-0.3, 0.125)),
        ((-0.3, -0.1), (-0.05, -0.1), (-0.05, 0.4), (-0.3, 0.4)),
    )
)


def test_the_separation_is_never_more_than_the_distance_and_decides_contact():
    shape, rng = ELL, np.random.default_rng(5)
    for _ in range(400):
        pose = np.array((*rng.uniform(-0.5, 0.5, 2), rng.uniform(-math.pi, math.pi)))
        ends = rng.uniform(-1.0, 1.0, 4)
        ends[2:] = ends[:2] + rng.uniform(-0.1, 0.1, 2)
        for shades in (False, True):
            surfaces = Chords(ends[None], np.array([shades]), np.zeros(2))
            far = (50.0 if shades else 1.0) * ends.reshape(2, 2)
            hidden = shapely.MultiPoint(np.vstack((ends.reshape(2, 2), far))).convex_hull
            body, apart = covered(shape, pose), separation(pose, shape, surfaces)
            exact = shapely.distance(body, hidden)
            assert apart <= exact + 1e-9
            assert (apart > 0.0) == (exact > 1e-12)
