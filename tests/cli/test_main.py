"""The command line as a person meets it: exit codes, messages, files."""

import json
import re
from pathlib import Path

import pytest

from drake_starnav.cli.benchmark import benchmark, report
from drake_starnav.cli.main import MODULES, main
from drake_starnav.cli.record import record
from drake_starnav.cli.show import show_world
from drake_starnav.cli.simulate import simulate
from drake_starnav.scenario.scenario_file import load_scenario, parse_scenario
from drake_starnav.scenario.shipped import METHODS, list_scenario_names
from drake_starnav.utils.compilation import COMPILING
from drake_starnav.worlds import WORLD_KINDS
from tests.helpers.trials import run_trials_here

FIELDS = {
    "scenario", "method", "seed", "outcome", "contact", "blocked_s", "blocked_by", "goals_s", "time_s", "path_length_m",
    "shortest_path_m", "straight_line_m", "tightest_gap_m", "score", "min_clearance_m", "mean_speed_mps",
    "mean_clearance_m", "path_s", "jerk_mps3",
    "yaw_rate_change_radps2", "twist_energy_m2ps", "stops", "stuck_s", "nodes", "wall_s", "state_hash", "command",
    "scan", "plan", "path", "text",
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
    assert parse_scenario(fields["text"], name="mine") == load_scenario(str(scenario_file))
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
        (["{folder}/start.yaml"], ["start", "cylinder"]),
        (["{folder}/nan.yaml"], ["nan", "cylinders[0]"]),
        (["forest", "--json", "{folder}"], ["cannot write", "folder"]),
    ],
)
def test_bad_input_exits_with_2_and_one_sentence(arguments, words, tmp_path: Path, capsys) -> None:
    (tmp_path / "start.yaml").write_text("world: !Obstacles {cylinders: [[0.2, 0, 0.3]]}\n")
    (tmp_path / "nan.yaml").write_text("world: !Obstacles {cylinders: [[2, .nan, 0.3]]}\n")
    assert simulate([argument.format(folder=tmp_path) for argument in arguments]) == 2
    printed = capsys.readouterr()
    (said,) = (line for line in printed.err.splitlines() if COMPILING not in line)
    assert printed.out == "" and "Traceback" not in said
    for word in words:
        assert word in said


MAP = "image: {0}\nresolution: 0.05\norigin: [0, 0, 0]\noccupied_thresh: 0.65\nfree_thresh: 0.2\n"


@pytest.mark.parametrize("kind", ["missing", "binary"])
@pytest.mark.parametrize(
    ("name", "arguments", "place", "allowed"),
    [
        ("x.yaml", ["simulate", "x.yaml"], "", "a text file in UTF-8|a mapping with world"),
        ("x.yaml", ["margins", "x.yaml"], "", "a text file in UTF-8|a mapping with world"),
        ("x.yaml", ["drive", "x.yaml"], "", "a text file in UTF-8|a mapping with world"),
        ("x.mcap", ["replay", "x.mcap"], "(log )?", "an MCAP file as drive"),
        ("x.mcap", ["calibrate", "x.mcap"], "(log )?", "an MCAP file as drive"),
        ("x.mcap", ["record", "--log", "x.mcap"], "(log )?", "an MCAP file as drive"),
        ("x.json", ["record", "x.json"], "file of trials ", "a file written by `starnav benchmark --json`"),
        ("x.json", ["report", "x.json"], "file of trials ", "a file written by `starnav benchmark --json`"),
        ("x.urdf", ["simulate", "room", "--set", "robot.model=x.urdf"], "robot model ", "a URDF file with one robot"),
        ("x.xacro", ["simulate", "room", "--set", "robot.model=x.xacro"], "robot model ", "a URDF file with one robot"),
        ("x.json", ["simulate", "barn", "--set", "world.file=x.json"], "world.file '", "barn_like, or the path"),
        ("x.yaml", ["simulate", "map", "--set", "world.file=x.yaml"], "map ", "a (text file in UTF-8|mapping with)"),
        ("x.pgm", ["simulate", "map", "--set", "world.file=map.yaml"], "map image ", "a complete PGM"),
        ("x.sdf", ["simulate", "kitchen", "--set", "world.directives=x.sdf"], "model ", "an? .*file|XML"),
    ],
)  # fmt: skip
def test_a_file_that_cannot_be_read_is_one_sentence(
    kind, name, arguments, place, allowed, tmp_path, monkeypatch, capsys
):
    """It names the file, says what is wrong with it, and what would be allowed."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "map.yaml").write_text(MAP.format("x.pgm"))
    if kind == "binary":
        (tmp_path / name).write_bytes(bytes(range(256)) * 20)
    assert main([*arguments, "--quiet"] if arguments[0] not in ("margins", "replay", "calibrate") else arguments) == 2
    (said,) = (line for line in capsys.readouterr().err.splitlines() if COMPILING not in line)
    told = {
        "missing": "cannot be read: no such file",
        "binary": "cannot be read: (no text|not well-formed)|not the log|another format",
    }[kind]
    assert re.search(rf"{place}[^ ]*{name}'? .*({told}).*; allowed: ({allowed})", said), said
    assert not re.search(r"Errno|codec|unpack|Traceback", said), said


def test_a_world_is_drawn(tmp_path: Path, capsys) -> None:
    file = tmp_path / "new" / "world.png"
    assert show_world(["kitchen", "--seed", "4", "--out", str(file)]) == 0
    printed = capsys.readouterr().out
    assert re.search(r"shortest path \d+\.\d\d m", printed)
    assert f"wrote {file}" in printed
    assert file.read_bytes().startswith(b"\x89PNG") and file.stat().st_size > 10_000


def test_no_command_writes_over_what_it_reads_or_has_written(
    scenario_file: Path, tmp_path: Path, monkeypatch, capsys
) -> None:
    run_trials_here(monkeypatch)
    text, twice = scenario_file.read_text(), str(tmp_path / "a.html")
    trials = tmp_path / "trials.jsonl"
    assert benchmark([str(scenario_file), "--trials", "1", "--jobs", "1", "--json", str(trials), "--quiet"]) == 0
    kept = trials.read_bytes()
    for command, arguments, word in (
        (simulate, [str(scenario_file), "--json", str(scenario_file)], "read and written"),
        (benchmark, [str(scenario_file), "--json", twice, "--csv", twice], "written twice"),
        (report, [str(trials), "--csv", str(trials)], "read and written"),
        (record, [str(trials), "--line", "2", "--html", str(trials)], "read and written"),
        (show_world, [str(scenario_file), "--out", str(scenario_file)], "allowed: a file whose name ends in"),
    ):
        assert command([*arguments, *(["--quiet"] if command is not show_world else [])]) == 2
        assert word in capsys.readouterr().err
    assert scenario_file.read_text() == text and trials.read_bytes() == kept


@pytest.mark.parametrize("arguments", [[], ["--help"]], ids=["bare", "help"])
def test_listing_names_every_command_scenario_method_and_world(arguments, capsys) -> None:
    assert main(arguments) == 0
    printed = capsys.readouterr().out
    for name in (*MODULES, *list_scenario_names(), *METHODS, *(f"!{kind}" for kind in WORLD_KINDS)):
        assert re.search(rf"(^|\W){re.escape(name)}(\W|$)", printed), name


def test_the_version_is_printed(capsys) -> None:
    assert main(["--version"]) == 0
    assert re.fullmatch(r"drake_starnav \S+ \(.+\), Drake \S+\n", capsys.readouterr().out)


def test_an_unknown_command_is_reported_with_the_nearest(capsys) -> None:
    assert main(["simulte"]) == 2
    printed = capsys.readouterr()
    assert printed.out == ""
    assert "unknown command 'simulte': did you mean simulate? allowed: demo, simulate, " in printed.err


def test_the_demo_leaves_its_recording_where_it_says(tmp_path: Path, monkeypatch, capsys) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(["demo", "--set", "simulation.timeout=0.5"]) == 1
    assert {path.name for path in (tmp_path / "out").iterdir()} == {"forest.html", "forest.json"}
    assert "out/forest.html" in capsys.readouterr().out
