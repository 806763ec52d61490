"""Figures for papers: vectors, axes in metres, only the chosen layers, small, the same each time."""

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from drake_starnav import Recorder, RobotParameters, StarnavError, parse_scenario, run_trial
from drake_starnav.cli.record import record
from drake_starnav.visualization.meshes import LAYERS, select_layers
from drake_starnav.visualization.plot import ON_TOP, draw_moment_figure, write_figure
from drake_starnav.visualization.world_figure import render_figure

TEXT = "world: !Obstacles {bounds: [-1, -2, 5, 2], cylinders: [[1.5, 0.1, 0.3]], goal: [3.5, 0.0]}\n"


@pytest.fixture(scope="module")
def recorded(tmp_path_factory):
    recorder = Recorder(tmp_path_factory.mktemp("recorded") / "post.html")
    run_trial(parse_scenario(TEXT, name="post"), observer=recorder)
    return recorder.recorded


def test_axes_are_in_metres_and_equal(recorded) -> None:
    axes = draw_moment_figure(recorded, 2.0).axes[0]
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("x in m", "y in m")
    assert axes.get_xlim() == pytest.approx((-1.0, 5.0), abs=0.2) and axes.get_ylim() == pytest.approx((-2, 2), abs=0.2)
    render_figure(axes.figure)
    box = axes.get_position()
    width, height = axes.figure.get_size_inches() * (box.width, box.height)
    assert width / height == pytest.approx(np.ptp(axes.get_xlim()) / np.ptp(axes.get_ylim()))
    order = ON_TOP + 100.0 * LAYERS["footprint"].height
    (rim,) = [patch for patch in axes.patches if patch.get_zorder() == order]
    corners = rim.get_path().get_extents().get_points()
    assert corners.mean(axis=0) == pytest.approx(recorded.motions[0].at(2.0)[:2], abs=0.01)
    assert corners[1] - corners[0] == pytest.approx(2.0 * RobotParameters().radius, abs=0.01)


def test_the_legend_has_room_for_its_text(recorded) -> None:
    lefts = []
    for label in ("goal", "goal, which the robot shall come to within its tolerance"):
        layers = {**recorded.caption.legend, "goal": replace(LAYERS["goal"], label=label)}
        figure = draw_moment_figure(replace(recorded, caption=replace(recorded.caption, layers=layers)), 2.0)
        render_figure(figure)
        axes, legend = (part.get_window_extent() for part in (figure.axes[0], figure.legends[0]))
        assert axes.x1 < legend.x0 and legend.x1 <= figure.bbox.x1
        lefts.append(legend.x0)
    assert lefts[1] < lefts[0] - 100.0


@pytest.mark.parametrize("suffix", [".svg", ".pdf"])
def test_files_are_small_repeatable_vectors(recorded, suffix, tmp_path) -> None:
    first, second = (tmp_path / f"{name}{suffix}" for name in "ab")
    for path in (first, second):
        write_figure(path, recorded, recorded.duration)
    content = first.read_bytes()
    assert content == second.read_bytes() and 10_000 < len(content) < 1_000_000
    assert b"<image" not in content and b"/Subtype /Image" not in content
    if suffix == ".svg":
        assert b"x in m" in content and b"footprint" in content


@pytest.mark.parametrize("width", [3.5, 7.0])
def test_a_figure_for_a_paper_has_its_width_and_truetype_fonts(recorded, width, tmp_path) -> None:
    path = tmp_path / "a.pdf"
    write_figure(path, recorded, 2.0, width)
    content = path.read_bytes()
    box = re.search(rb"/MediaBox \[ 0 0 ([0-9.]+) ", content)
    assert box is not None and float(box[1]) == pytest.approx(72.0 * width, abs=0.5)
    assert b"/Subtype /Type3" not in content and b"/FontFile2" in content  # TrueType, embedded
    figure = draw_moment_figure(recorded, 2.0, title="A title", width=width)
    assert figure.axes[0].get_title(loc="left") == "A title" and figure.legends


def test_a_width_in_another_unit_than_inches_is_refused(recorded, tmp_path) -> None:
    with pytest.raises(StarnavError, match="width of .* is 250 in; allowed: 2 to 50 inches"):
        write_figure(tmp_path / "a.pdf", recorded, 2.0, width=250)


def test_only_chosen_layers_are_drawn_and_in_the_legend(recorded, tmp_path) -> None:
    sizes = {}
    for names in ("trail", "trail,scan,frontiers"):
        shown = select_layers(names, LAYERS)
        path = tmp_path / f"{names}.svg"
        write_figure(path, replace(recorded, caption=replace(recorded.caption, shown=shown)), 2.0)
        text = path.read_text(encoding="utf-8")
        assert ("laser scan" in text) == ("scan" in names) and "robot" in text and "star-shaped" not in text
        sizes[names] = len(text)
    assert sizes["trail"] < sizes["trail,scan,frontiers"]


@pytest.mark.parametrize("compared", [[], ["--compare", "star", "star_paper"]], ids=["one", "compared"])
def test_record_writes_svg_and_pdf(compared, tmp_path, monkeypatch, capsys) -> None:
    monkeypatch.chdir(tmp_path)
    Path("mine.yaml").write_text(TEXT + "simulation: {timeout: 1.5}\n")
    layers = ["--layers", "trail,scan"]
    assert record(["mine.yaml", *compared, "--html", "a.html", "--svg", "--pdf", "0.5", "1", *layers]) == 0
    assert {path.name for path in tmp_path.iterdir()} == {"mine.yaml", "a.html", "a.svg", "a-0.5s.pdf", "a-1s.pdf"}
    text = Path("a.svg").read_text(encoding="utf-8")
    assert len(text) < 1_000_000 and "x in m" in text
    assert ("star_paper: timeout" if compared else "trail, 0 to") in text
    assert record(["mine.yaml", "--svg", "9", "--quiet"]) == 2
    assert "--svg is 9, after the run; allowed: times up to 1.5 s" in capsys.readouterr().err
