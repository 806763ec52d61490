"""Hits as chords, and hits that a limited view has left behind."""

import math

import numpy as np

from drake_starnav.lidar.field_of_view import FieldOfView
from drake_starnav.regions.bearing_hits import CONNECTED_CHORD
from drake_starnav.regions.chords import chords, hits_behind

NOTHING = np.zeros((0, 2))


def on_circle(*degrees: float) -> np.ndarray:
    angle = np.radians(degrees)
    return np.column_stack((np.cos(angle), np.sin(angle)))


def test_neighbours_on_a_surface_are_joined_and_others_stay_alone():
    hits = on_circle(0.0, 4.0, 8.0, 90.0, 180.0)
    ends = chords(hits, 0, NOTHING, np.zeros(2)).ends
    lengths = np.hypot(*(ends[:, 2:] - ends[:, :2]).T)
    assert sorted(lengths > 0.0) == [False, False, True, True]
    assert lengths.max() < CONNECTED_CHORD
    for hit in hits:  # none is lost
        assert (np.hypot(*(ends[:, :2] - hit).T).min() < 1e-12) or (np.hypot(*(ends[:, 2:] - hit).T).min() < 1e-12)


def test_the_last_scan_shades_in_order_of_its_bearings_and_joins_over_its_seam():
    earlier, latest = on_circle(0.0, 90.0), on_circle(179.0, -179.0, 165.0)
    surfaces = chords(np.vstack((earlier, latest)), 2, on_circle(45.0), np.zeros(2))
    shading = surfaces.ends[surfaces.shades]
    assert len(shading) == 2
    assert sorted(np.hypot(*(shading[:, 2:] - shading[:, :2]).T) > 0.0) == [False, True]
    assert (~surfaces.shades).sum() == 3


def test_hits_are_remembered_only_where_the_lidar_does_not_look():
    view = FieldOfView(-0.75 * math.pi, 1.5 * math.pi / 269, 270)
    hits = np.vstack((on_circle(0.0, 130.0, 140.0, 180.0, 220.0), 3.0 * on_circle(180.0)))
    kept = hits_behind(NOTHING, hits, view, np.zeros(3), 2.0)
    np.testing.assert_allclose(kept, on_circle(140.0, 180.0, 220.0))
    turned = hits_behind(kept, NOTHING, view, np.array((0.0, 0.0, math.pi)), 2.0)
    assert len(turned) == 0
    again = hits_behind(kept, kept + 1e-3, view, np.zeros(3), 2.0)
    assert len(again) <= 2 * len(kept)
