"""The command `record` as a person meets it: what it repeats, what it writes, what it says."""

import argparse
import json
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from drake_starnav.cli.benchmark import benchmark
from drake_starnav.cli.record import choose_run, record
from drake_starnav.cli.simulate import simulate
from drake_starnav.utils.compilation import COMPILING
from tests.helpers.trials import run_trials_here

WORLD = "world: !Obstacles {cylinders: [[0.9, 0.8, 0.3]], goal: [1.5, 0.0]}\nsimulation: {timeout: 1.5}\n"


@pytest.fixture(autouse=True)
def _in_this_process(monkeypatch) -> None:
    run_trials_here(monkeypatch)


@pytest.fixture
def scenario(tmp_path: Path, monkeypatch) -> str:
    monkeypatch.chdir(tmp_path)
    Path("mine.yaml").write_text(WORLD)
    return "mine.yaml"


def names(folder: str) -> set[str]:
    return {path.name for path in Path(folder).iterdir()}


def test_a_scenario_leaves_a_recording_stills_and_a_clip(scenario, capsys) -> None:
    arguments = [scenario, "--seed", "2", "--png", "0", "1.25", "--gif", "--width", "440"]
    assert record([*arguments, "--rate", "4"]) == 0
    assert names("out") == {"mine-star-2" + end for end in (".html", "-0s.png", "-1.25s.png", ".gif")}
    with Image.open("out/mine-star-2.gif") as clip:
        assert clip.width == 440
        assert clip.n_frames == 1 + 3
    with Image.open("out/mine-star-2-0s.png") as first, Image.open("out/mine-star-2-1.25s.png") as second:
        assert np.abs(np.asarray(first, float) - np.asarray(second, float)).max() > 50.0
    assert "mine-star-2.gif" in capsys.readouterr().out


def test_a_trial_is_repeated_with_its_own_settings(scenario, capsys) -> None:
    settings = ["--method", "star_paper", "--seed", "5", "--set", "robot.max_speed=0.4", "--quiet"]
    simulate([scenario, *settings, "--json", "trial.json"])
    assert record(["trial.json", "--html", "again.html", "--quiet"]) == 0
    text = Path("again.html").read_text(encoding="utf-8")
    assert "method star_paper, seed 5" in text and "trail, 0 to 0.4 m/s" in text
    assert [line for line in capsys.readouterr().err.splitlines() if COMPILING not in line] == []


ROBOTS = "robots: [{start: [0, 0, 0], goal: [2, 0]}, {name: box, model: jackal, start: [3, 0, 0], goal: [0, 1]}]\n"


def test_a_run_of_several_robots_is_recorded_and_repeated(tmp_path: Path, monkeypatch, capsys) -> None:
    monkeypatch.chdir(tmp_path)
    Path("several.yaml").write_text(f"world: !Obstacles {{}}\n{ROBOTS}simulation: {{timeout: 0.2}}\n")
    assert record(["several.yaml", "--svg", "--layers", "trail/box", "--quiet"]) == 0
    assert names("out") == {"several-star-0.html", "several-star-0.svg"}
    simulate(["several.yaml", "--seed", "5", "--quiet", "--json", "run.json"])
    assert record(["run.json", "--html", "again.html", "--quiet"]) == 0
    assert "box: timeout" in Path("again.html").read_text(encoding="utf-8")
    few = ["--trials", "1", "--jobs", "1", "--json", "trials.jsonl"]
    assert benchmark(["several.yaml", *few]) == 0
    assert "several/box" in capsys.readouterr().out
    assert record(["trials.jsonl", "--html", "third.html", "--quiet"]) == 0
    assert record(["several.yaml", "--compare", "star", "dwa"]) == 2
    assert "of several robots; allowed: one of one robot" in capsys.readouterr().err


def test_a_trial_in_a_numbered_world_is_repeated_in_that_world(tmp_path: Path) -> None:
    path = tmp_path / "trials.jsonl"
    few = ["--set", "simulation.timeout=0.1", "--jobs", "1", "--quiet"]
    assert benchmark(["barn", "--worlds", "2,5", *few, "--json", str(path)]) == 0
    for line, world in ((2, 2), (3, 5)):
        others = dict.fromkeys(("method", "seed", "compare", "log"))
        arguments = argparse.Namespace(run=str(path), line=line, overrides=[], **others)
        assert choose_run(arguments).scenarios["star"].world.id == world


def test_a_trial_of_a_batch_is_chosen_by_its_line(scenario, capsys) -> None:
    assert benchmark([scenario, "--trials", "2", "--jobs", "1", "--json", "trials.jsonl", "--quiet"]) == 0
    lines = Path("trials.jsonl").read_text().splitlines()
    assert record(["trials.jsonl", "--line", "3", "--html", "third.html", "--quiet"]) == 0
    assert f"seed {json.loads(lines[2])['seed']}" in Path("third.html").read_text(encoding="utf-8")
    for line in ([], ["--line", "4"], ["--line", "1"]):
        assert record(["trials.jsonl", *line]) == 2
        assert "allowed: --line 2 to --line 3" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["forrest"], "did you mean forest"),
        (["missing.json"], "missing.json cannot be read"),
        (["mine.yaml", "--line", "2"], "with a file of trials"),
        (["mine.yaml", "--view", "side"], "camera view is 'side'; allowed: one of top, follow, oblique"),
        (["mine.yaml", "--png", "-1"], "--png is -1"),
        (["mine.yaml", "--png", "99"], "after the run; allowed: times up to 1.5 s"),
        (["mine.yaml", "--width", "5"], "--width is 5; allowed: 100 <= x <= 4400"),
        (["mine.yaml", "--gif", "--view", "oblique"], "--view oblique with stills or clips"),
        (["mine.yaml", "--compare", "star", "star"], "allowed: each method once"),
        (["mine.yaml", "--compare", "star", "--method", "star"], "--compare and --method"),
        (["mine.yaml", "--html", "/proc/forbidden/x.html"], "cannot write"),
        (["trial.json", "--seed", "3"], "--seed with a trial, which has its own"),
        (["half.json"], "has no seed; allowed: as `simulate --json` writes it"),
        (["letter.json"], "cannot be read: no JSON"),
    ],
)
def test_bad_input_is_one_sentence(arguments, words, scenario, capsys) -> None:
    half = {"scenario": "mine", "method": "star"}
    for name, text in (("half", json.dumps(half)), ("trial", json.dumps(half | {"seed": 0})), ("letter", "a letter")):
        Path(f"{name}.json").write_text(text + "\n")
    assert record([*arguments, "--quiet"]) == 2
    error = capsys.readouterr().err
    assert words in error
    assert error.count("\n") == 1
