"""Something may come from behind what stays."""

import numpy as np

from drake_starnav.movers.hidden import hidden_places
from drake_starnav.scan import MOVES, STAYS
from tests.movers.scenes import hall
from tests.scans import cast

COLUMN = (1.0, 0.0, 0.3)


def test_places_lie_in_the_shadow_s_edges_and_no_beam_has_looked_there() -> None:
    scan = cast(hall(COLUMN))
    places = hidden_places(scan, np.full(360, STAYS), np.zeros(3))
    assert len(places) > 10
    away = np.hypot(*places.T)
    assert away.min() > 0.9 and away.max() < 3.0
    bearing = np.abs(np.arctan2(places[:, 1], places[:, 0]))
    edge = np.arcsin(COLUMN[2] / COLUMN[0])
    assert (np.abs(bearing - edge) < 2.0 * scan.angle_increment).all()


def test_what_moves_hides_nothing_and_an_empty_hall_neither() -> None:
    scan = cast(hall(COLUMN))
    assert len(hidden_places(scan, np.full(360, MOVES), np.zeros(3))) == 0
    assert len(hidden_places(cast(hall()), np.full(360, STAYS), np.zeros(3))) == 0
