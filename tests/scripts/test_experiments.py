"""The scripts that draw the paper's figures and the benchmark's references, on a few scans."""

import sys

import pytest

from benchmarks import pipeline
from benchmarks.kinematic_drive import ROBOT, drive
from drake_starnav.lidar.sensor_model import LidarParameters
from drake_starnav.surroundings.piecewise_cubic import TOLERANCE
from drake_starnav.worlds import Room, make_world
from scripts.experiments import ablate_segments, compare_regions
from tests.helpers.scans import MARGINS


@pytest.fixture(scope="module")
def segments() -> dict[tuple[str, str], ablate_segments.Deviation]:
    rows = ablate_segments.methods()
    results = ablate_segments.measured(rows, ablate_segments.sample_views(8, 0, LidarParameters(), 0.25), 0.25)
    return {(row.side, row.label): result for row, result in zip(rows, results, strict=True)}


def test_one_sided_fits_claim_nothing(segments) -> None:
    for (side, _), result in segments.items():
        if side == "one-sided":
            assert result.claimed.max() < 1e-9


def test_adaptive_segments_keep_their_tolerance(segments) -> None:
    for side in ("two-sided", "one-sided"):
        adaptive = segments[side, "adaptive"]
        assert adaptive.largest.max() <= TOLERANCE * 0.25 + 1e-9
        for count in ablate_segments.FIXED:
            fixed = segments[side, f"{count} fixed"]
            assert (fixed.segments == count).all()
            assert adaptive.mean.mean() < fixed.mean.mean()


def test_no_region_covers_more_than_was_seen_and_the_ellipse_less_than_its_polytope() -> None:
    parameters = MARGINS
    for view in ablate_segments.sample_views(4, 1, LidarParameters(), 0.25):
        star, polytope, ellipse = compare_regions.compare(view, parameters).areas
        assert 0.0 < ellipse <= polytope + 1e-6
        assert polytope <= 1.0 + 1e-9
        assert 0.9 < star <= 1.0 + 1e-9


@pytest.mark.parametrize("script", [ablate_segments, compare_regions], ids=lambda script: script.__name__)
def test_a_script_writes_table_and_picture(script, tmp_path, monkeypatch, capsys) -> None:
    name = script.__name__.rpartition(".")[2]
    monkeypatch.setattr(sys, "argv", [name, "--scans", "3", "--out", str(tmp_path / "new")])
    assert script.main() == 0
    text = (tmp_path / "new" / f"{name}.md").read_text(encoding="utf-8")
    assert text in capsys.readouterr().out
    assert "3 scans" in text
    assert (tmp_path / "new" / f"{name}.png").read_bytes().startswith(b"\x89PNG")


def test_each_step_of_the_pipeline_is_timed() -> None:
    kept = drive(make_world(Room(), 3, ROBOT.radius), 3, 4.0)
    for calls in pipeline.steps(kept).values():
        assert calls and (pipeline.interleaved([(call,) for call in calls[:2]], 1) > 0.0).all()
