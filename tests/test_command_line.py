"""The command line as a person meets it: exit codes, messages, files."""

import json
import os
from pathlib import Path

import pytest

from drake_starnav.command_line import main, simulate

FIELDS = {
    "scenario", "method", "seed", "outcome", "time_s", "path_length_m", "shortest_path_m", "straight_line_m",
    "tightest_gap_m", "min_clearance_m", "mean_speed_mps", "nodes", "wall_s", "state_hash", "command", "scan", "fit",
    "plan", "path",
}  # fmt: skip


@pytest.fixture
def scenario_file(tmp_path: Path) -> Path:
    path = tmp_path / "mine.yaml"
    path.write_text("world: !Obstacles {cylinders: [[1.0, 0.9, 0.3]], goal: [1.5, 0.0]}\n")
    return path


def test_a_run_writes_its_record_and_exits_with_0(scenario_file: Path, tmp_path: Path, capsys) -> None:
    record = tmp_path / "new" / "trial.json"
    assert simulate([str(scenario_file), "--seed", "2", "--json", str(record)]) == 0
    fields = json.loads(record.read_text())
    assert set(fields) == FIELDS
    assert (fields["scenario"], fields["method"], fields["seed"], fields["outcome"]) == ("mine", "star", 2, "reached")
    assert set(fields["plan"]) == {"count", "mean_s", "p50_s", "p99_s"}
    assert list(record.parent.iterdir()) == [record]  # no temporary file is left
    assert "reached" in capsys.readouterr().out


def test_not_reached_exits_with_1(scenario_file: Path, capsys) -> None:
    assert simulate([str(scenario_file), "--set", "simulation.timeout=0.5", "--quiet"]) == 1
    assert capsys.readouterr().out == ""


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["forrest"], ["forrest", "did you mean forest"]),
        (["forest", "--method", "stra"], ["stra", "star"]),
        (["forest", "--set", "robot.radis=1"], ["robot.radis", "did you mean radius"]),
        (["forest", "--seed", "-1"], ["--seed", "-1"]),
        (["{start_in_obstacle}"], ["start", "cylinder"]),
        (["{nan}"], ["nan", "cylinders[0]"]),
        (["forest", "--json", "{folder}"], ["cannot write", "folder"]),
        (["forest", "--html", "/proc/forbidden/x.html"], ["cannot write", "/proc/forbidden/x.html"]),
    ],
)
def test_bad_input_exits_with_2_and_one_sentence(arguments, words, tmp_path: Path, capsys) -> None:
    (tmp_path / "start.yaml").write_text("world: !Obstacles {cylinders: [[0.2, 0, 0.3]]}\n")
    (tmp_path / "nan.yaml").write_text("world: !Obstacles {cylinders: [[2, .nan, 0.3]]}\n")
    places = {
        "start_in_obstacle": tmp_path / "start.yaml", "nan": tmp_path / "nan.yaml", "folder": tmp_path,
    }  # fmt: skip
    assert simulate([argument.format(**places) for argument in arguments]) == 2
    printed = capsys.readouterr()
    assert printed.out == ""
    assert printed.err.count("\n") == 1
    assert "Traceback" not in printed.err
    for word in words:
        assert word in printed.err


@pytest.mark.skipif(os.geteuid() == 0, reason="root may write anywhere")
def test_write_protected_file_is_told_before_the_run(scenario_file: Path, tmp_path: Path, capsys) -> None:
    target = tmp_path / "kept.json"
    target.write_text("kept")
    target.chmod(0o444)
    assert simulate([str(scenario_file), "--json", str(target)]) == 2
    assert target.read_text() == "kept"


def test_listing_names_everything(capsys) -> None:
    assert main([]) == 0
    printed = capsys.readouterr().out
    for word in ("simulate", "forest", "room", "star_paper"):
        assert word in printed
    assert main(["nonsense"]) == 2
