"""The costs of many trials follow from the measured figures."""

import pytest

from scripts.maintenance.trial_costs import Costs, costs_section

KNOWN = Costs(
    "a machine", ["forest"], 24, 3, one_s=48.0, two_s=25.0, longest_s=5.0, start_s=2.0, filed_per_s=200.0
)  # fmt: skip


def test_costs_of_known_figures() -> None:
    assert KNOWN.speedup == pytest.approx(1.92)
    assert KNOWN.trial_s == pytest.approx(25.0 / 12.0)
    assert KNOWN.wall_s(100, 10) == pytest.approx(2.0 + 100 * 25.0 / 12.0 / 10 + 5.0)
    assert KNOWN.wall_s(100_000, 1000) == pytest.approx(2.0 + 500.0 + 5.0)  # filing is slower than a thousand cores
    assert "| 1,000 | 507 s" in costs_section(KNOWN)
