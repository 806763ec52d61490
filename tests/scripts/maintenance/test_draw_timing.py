"""The figure of the updates shows what the docs say about them."""

import pytest

from scripts.maintenance.draw_timing import BEGIN, ROWS, timing_figure, update_times


def test_planner_and_lidar_are_updated_together_and_the_shield_at_its_own_rate() -> None:
    times = update_times()
    assert times["lidar"] == times["planner"] == pytest.approx([BEGIN, BEGIN + 0.05, BEGIN + 0.1])
    assert times["shield"] == pytest.approx([BEGIN + 0.02 * k for k in range(6)])
    assert set(times["lidar"]) <= set(times["plant"])  # the plant's steps end at updates


def test_each_scan_is_drawn_to_the_first_command_that_uses_it() -> None:
    times = {"lidar": [BEGIN], "planner": [BEGIN], "shield": [BEGIN, BEGIN + 0.02], "plant": [BEGIN]}
    (axes,) = timing_figure(times).axes
    labels = [text.get_text() for text in axes.texts]
    assert all(cls in labels for cls, _ in ROWS.values())
    arrows = [text for text in axes.texts if getattr(text, "arrow_patch", None) is not None]
    assert [arrow.xy for arrow in arrows] == [(0.0, 2)]
