"""Whatever is wrong with what a command is given: one line, exit code 2, and the files as they were."""

import json
import os
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from drake_starnav.cli.benchmark import benchmark, report
from drake_starnav.cli.main import main
from drake_starnav.cli.record import record
from drake_starnav.cli.show import show_world
from drake_starnav.cli.simulate import simulate
from tests.helpers.full_disk import largest_file

WORLD = "world: !Obstacles {cylinders: [[0.9, 0.8, 0.3]], goal: [0.2, 0.0]}\n"
LAUGHS = "[&x0 [l,l,l,l,l,l,l,l,l,l]" + "".join(f", &x{k} [{','.join([f'*x{k - 1}'] * 10)}]" for k in range(1, 9)) + "]"
"""A billion entries in half a kilobyte."""
NUMBERS = LAUGHS.replace("l", "1")


def obstacles(text: str) -> str:
    return f"world: !Obstacles {{goal: [5, 0], {text}}}\n"


SCENARIOS: dict[str, str] = {
    "laughs": LAUGHS,
    "laughs_as_radius": f"{WORLD}robot: {{radius: {LAUGHS}}}\n",
    "laughs_as_section": f"{WORLD}robot: {LAUGHS}\n",
    "laughs_as_key": f"{WORLD}? {LAUGHS}\n: 1\n",
    "laughs_as_start": obstacles(f"start: {LAUGHS}"),
    "laughs_as_cylinders": obstacles(f"cylinders: {NUMBERS}"),
    "laughs_as_polygons": obstacles(f"polygons: {NUMBERS}"),
    "laughs_as_file": f"world: !Barn {{file: {LAUGHS}}}\n",
    "laughs_as_world": f"world: {LAUGHS}\n",
    "laughs_merged": "a: &a {x: 1}\n" + "".join(f"{c}: &{c} {{<<: [{','.join(['*a'] * 99)}]}}\n" for c in "bcd"),
    "some_laughs": f"world: {LAUGHS.replace(',*x0' * 9, '').replace(',*x1' * 9, '').replace(',*x2' * 9, '')}\n",
    "itself": "world: &a [*a]\n",
    "itself_in_a_mapping": "&a x: {y: *a, z: [*a]}\n",
    "deep": "[" * 100_000,
    "deep_mappings": "{a: " * 3000,
    "deep_blocks": "".join(" " * k + "a:\n" for k in range(1000)),
    "many_values": "world: [" + "1," * 1_100_000 + "]\n",
    "long_key": f"{WORLD}{'k' * 100_000}: 1\n",
    "long_text": f"{WORLD}robot: {{model: {'x' * 100_000}}}\n",
    "huge_number": f"{WORLD}robot: {{radius: {'9' * 100_000}}}\n",
    "huge_hexadecimal": f"{WORLD}robot: {{radius: 0x{'f' * 100_000}}}\n",
    "huge_hexadecimal_place": obstacles(f"start: [0x{'f' * 100_000}, 0, 0]"),
    "tab": "world: !Obstacles\n\tgoal: [1, 0]\n",
    "null_byte": "world: \0\n",
    "escape": 'world: "\\e[2J\\n"\n',
    "two_documents": f"{WORLD}---\n{WORLD}",
    "empty": "",
    "not_a_number": obstacles("start: [.nan, 0, 0]"),
    "infinite": obstacles("bounds: [-.inf, -2, 2, 2]"),
    "tiny_cylinder": obstacles("cylinders: [[3, 0, 1.0e-300]]"),
    "hair": obstacles("cylinders: [[3, 0, 1.0e-6]]"),
    "far_cylinder": obstacles("cylinders: [[1.0e+300, 0, 0.3]]"),
    "huge_cylinder": obstacles("cylinders: [[1.0e+299, 0, 1.0e+299]]"),
    "tiny_polygon": obstacles("polygons: [[[3, 0], [3.0000000001, 0], [3, 1.0e-300]]]"),
    "far_polygon": obstacles("polygons: [[[3, 0], [1.0e+300, 0], [3, 1.0e+300]]]"),
    "far_goal": "world: !Obstacles {goal: [1.0e+9, 0]}\n",
    "rather_far_goal": "world: !Obstacles {goal: [90000, 0], cylinders: [[3, 0, 0.3]]}\n",
    "turned_start": obstacles("start: [0, 0, 1.0e+300]"),
    "many_cylinders": obstacles(f"cylinders: {[[9 + k / 1000, 9, 0.1] for k in range(3001)]}"),
    "many_corners": obstacles(f"polygons: {[[[9 + k / 1000, 9 + k % 2] for k in range(20_001)]]}"),
    "rate": f"{WORLD}controller: {{rate: 1.0e-300}}\n",
    "step": f"{WORLD}simulation: {{time_step: 1.0e-300}}\n",
}


@pytest.fixture
def folder(tmp_path: Path, monkeypatch) -> Path:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "good.yaml").write_text(WORLD)
    return tmp_path


def content(folder: Path) -> dict[str, bytes]:
    return {str(p.relative_to(folder)): p.read_bytes() if p.is_file() else b"" for p in folder.rglob("*")}


def refused(command: Callable, arguments: list[str], folder: Path, capsys) -> str:
    """The line that a command says; it must end with 2 and leave the folder as it was."""
    before = content(folder)
    assert command(arguments) == 2
    printed = capsys.readouterr()
    assert content(folder) == before
    assert printed.out == "" and printed.err.count("\n") == 1, printed
    assert len(printed.err) < 1500 and printed.err[:-1].isprintable()
    assert "allowed" in printed.err
    return printed.err


@pytest.mark.parametrize("name", SCENARIOS)
def test_a_scenario_is_refused(name: str, folder: Path, capsys) -> None:
    (folder / "bad.yaml").write_text(SCENARIOS[name], encoding="utf-8")
    refused(simulate, ["bad.yaml", "--json", "new/a.json", "--html", "new/a.html"], folder, capsys)


@pytest.mark.parametrize(
    "override",
    [f"robot.radius={LAUGHS}", f"world.start={LAUGHS}", "robot.radius=[[[" + "[" * 9999, "controller.rate=1e-300",
     "lidar.rate=1e-300", "simulation.time_step=1e-300", "robot.max_acceleration=1e-300", "robot.radius=1e-300",
     "k" * 9999 + ".x=1", "robot." + "k" * 9999 + "=1", "robot.radius=0x" + "f" * 9999, "robot.radius=\0", "\x1b[2J"],
    ids=lambda text: text[:24].encode("unicode_escape").decode(),
)  # fmt: skip
def test_an_override_is_refused(override: str, folder: Path, capsys) -> None:
    refused(simulate, ["good.yaml", "--set", override, "--json", "new/a.json"], folder, capsys)


def make_files(folder: Path) -> None:
    """What is no file, or none that ends."""
    os.mkfifo(folder / "pipe.yaml")
    os.mkfifo(folder / "pipe.json")
    (folder / "loop.yaml").symlink_to("loop.yaml")
    for name in ("zero.yaml", "zero.json", "zero.jsonl"):
        (folder / name).symlink_to("/dev/zero")
    (folder / "folder.yaml").mkdir()
    (folder / "latin.yaml").write_bytes(b"world: \xe4\n")
    (folder / "utf16.yaml").write_bytes("world: !Room {}\n".encode("utf-16"))
    (folder / "trial.json").write_text('{"scenario": "good", "method": "star", "seed": 0}')
    (folder / "yes.json").write_text('{"scenario": "good", "method": "star", "seed": true}')
    (folder / "large.json").write_text(f'{{"scenario": "good", "method": "star", "seed": {10**30}}}')
    (folder / "no.jsonl").write_bytes(b"\xff\n")


def huge(folder: Path, name: str) -> None:
    with open(folder / name, "wb") as file:
        file.truncate(10**12)


@pytest.mark.parametrize(
    ("command", "arguments"),
    [
        *((simulate, [f"{name}.yaml"]) for name in ("pipe", "loop", "zero", "folder", "latin", "utf16", "a\0b", "")),
        (simulate, [""]),
        (simulate, ["good.yaml", "--seed", str(10**30)]),
        (simulate, ["good.yaml", "--json", ""]),
        (simulate, ["good.yaml", "--json", "good.yaml/x.json"]),
        (simulate, ["good.yaml", "--json", "/dev/full"]),
        (simulate, ["good.yaml", "--json", "loop.yaml"]),
        (simulate, ["good.yaml", "--json", "x" * 300]),
        (simulate, ["good.yaml", "--json", "a", "--html", "./a"]),
        (simulate, ["good.yaml", "--json", "a", "--html", "a/b"]),
        (simulate, ["good.yaml", "--meshcat", "--json", "a"]),
        (show_world, ["good.yaml", "--out", "folder.yaml/../.png/"]),
        (show_world, ["good.yaml", "--out", "good.yaml/a.png"]),
        *((record, [f"{name}"]) for name in ("pipe.json", "zero.json", "zero.jsonl", "yes.json", "large.json")),
        (record, ["no.jsonl"]),
        *((record, ["good.yaml", "--gif", "--html", name]) for name in ("/", ".", "..", "")),
        (record, ["good.yaml", "--png", "inf"]),
        (record, ["good.yaml", "--png", "nan"]),
        (record, ["good.yaml", "--speed", "nan", "--gif"]),
        (record, ["good.yaml", "--png", "1", "--html", "a.html", "--gif", "a-1s.png"]),
        *((report, [name]) for name in ("pipe.json", "zero.jsonl", "no.jsonl", ".")),
        (benchmark, ["good.yaml", "--trials", str(10**12)]),
        (benchmark, ["good.yaml", "--jobs", str(10**6)]),
        (benchmark, ["good.yaml", "--seed", str(10**30)]),
        (benchmark, ["good.yaml", "--json", "pipe.json"]),
        (benchmark, ["good.yaml", "--json", "no.jsonl"]),
        (benchmark, ["good.yaml", "--json", "no.jsonl", "--resume"]),
        (benchmark, ["good.yaml", "--json", "good.yaml", "--resume"]),
        (benchmark, ["good.yaml", "--json", "a\0b"]),
        (benchmark, ["good.yaml", "--html", "folder.yaml"]),
        (benchmark, ["good.yaml", "--csv", "a", "--markdown", "a"]),
        (benchmark, ["good.yaml", "good.yaml"]),
        (main, ["x" * 9999]),
    ],
    ids=lambda value: " ".join(value)[:40].encode("unicode_escape").decode() if isinstance(value, list) else None,
)
def test_what_is_no_file_of_its_kind_is_refused(command: Callable, arguments: list[str], folder: Path, capsys) -> None:
    before = os.umask(0o022)
    os.umask(before)
    make_files(folder)
    names = sorted(os.listdir(folder))
    assert command(arguments) == 2
    printed = capsys.readouterr()
    assert sorted(os.listdir(folder)) == names
    assert printed.out == "" and printed.err.count("\n") == 1 and len(printed.err) < 1500, printed


@pytest.mark.parametrize(
    ("command", "name"),
    [(simulate, "h.yaml"), (record, "h.json"), (show_world, "h.yaml")],
    ids=["yaml", "json", "world"],
)
def test_a_file_larger_than_memory_is_not_read(command: Callable, name: str, folder: Path, capsys) -> None:
    huge(folder, name)
    assert command([name]) == 2
    assert "bytes, more than" in capsys.readouterr().err


@pytest.mark.parametrize("text", ["origin: " + NUMBERS, "image: " + LAUGHS, "mode: " + LAUGHS, "x: " + LAUGHS])
def test_a_map_is_refused(text: str, folder: Path, capsys) -> None:
    keys = {
        "image": "a.pgm",
        "resolution": "0.05",
        "origin": "[0, 0, 0]",
        "occupied_thresh": "0.6",
        "free_thresh": "0.2",
    }
    keys[text.partition(": ")[0]] = text.partition(": ")[2]
    (folder / "m.yaml").write_text("".join(f"{key}: {value}\n" for key, value in keys.items()))
    (folder / "bad.yaml").write_text("world: !RosMap {file: m.yaml}\n")
    refused(simulate, ["bad.yaml"], folder, capsys)


@pytest.mark.parametrize(
    "text", ["[" * 99_999, '{"worlds": [{"id": ' + "9" * 9999 + "}]}", "\ufeff{", '{"worlds": NaN}']
)
def test_a_file_of_worlds_is_refused(text: str, folder: Path, capsys) -> None:
    (folder / "w.json").write_text(text, encoding="utf-8")
    (folder / "bad.yaml").write_text("world: !Barn {file: w.json}\n")
    refused(simulate, ["bad.yaml"], folder, capsys)


@pytest.mark.parametrize("name", ["../../escaped", "/escaped", "x" * 999, "a\0b", ".hidden"])
def test_a_trial_cannot_choose_where_its_recording_goes(name: str, folder: Path) -> None:
    (folder / "in").mkdir()
    os.chdir(folder / "in")
    Path("t.json").write_text(json.dumps({"scenario": name, "method": "star", "seed": 0, "text": WORLD}))
    assert record(["t.json", "--quiet"]) == 0
    assert sorted(path.name for path in folder.iterdir()) == ["good.yaml", "in"]
    (written,) = Path("out").iterdir()
    assert written.name.endswith("-star-0.html") and not written.name.startswith(".")


ENDLESS = {
    "listing": (main, []),
    "simulate": (simulate, ["good.yaml"]),
    "simulate_json": (simulate, ["good.yaml", "--json", "a.json"]),
    "show_world": (show_world, ["good.yaml", "--out", "a.png"]),
    "record": (record, ["good.yaml", "--html", "a.html"]),
    "benchmark": (benchmark, ["good.yaml", "--trials", "1", "--jobs", "1"]),
    "report": (report, ["t.jsonl"]),
    "help": (simulate, ["--help"]),
}


@pytest.mark.parametrize("name", ENDLESS)
def test_output_to_a_full_disk_is_reported(name: str, folder: Path, monkeypatch, capsys) -> None:
    command, arguments = ENDLESS[name]
    if name == "report":
        assert benchmark(["good.yaml", "--trials", "1", "--jobs", "1", "--json", "t.jsonl", "--quiet"]) == 0
    with open("/dev/full", "w") as full:
        monkeypatch.setattr(sys, "stdout", full)
        assert command(arguments) == 2
        monkeypatch.undo()
    printed = capsys.readouterr().err
    assert "No space left on device; allowed" in printed.splitlines()[-1] and "Traceback" not in printed


@pytest.mark.parametrize(
    ("command", "arguments", "size"),
    [
        (simulate, ["good.yaml", "--json", "new/a.json"], 100),
        (simulate, ["good.yaml", "--html", "new/a.html"], 10_000),
        (show_world, ["good.yaml", "--out", "new/a.png"], 1000),
        (show_world, ["good.yaml", "--out", "new/a.html"], 1000),
        (record, ["good.yaml", "--html", "new/a.html"], 1000),
        (benchmark, ["good.yaml", "--trials", "1", "--jobs", "1", "--json", "new/a.jsonl"], 1000),
        (report, ["t.jsonl", "--quiet", "--csv", "new/a.csv"], 10),
        (report, ["t.jsonl", "--quiet", "--markdown", "new/a.md"], 10),
        (report, ["t.jsonl", "--quiet", "--recordings", "--html", "new/a.html"], 10),
    ],
    ids=lambda value: " ".join(value[1:]) if isinstance(value, list) else None,
)
def test_a_file_for_which_there_is_no_room_is_reported_and_not_left(
    command, arguments, size, folder: Path, capsys
) -> None:
    one = ["good.yaml", "--trials", "1", "--jobs", "1", "--json", "t.jsonl", "--quiet"]
    assert simulate(["good.yaml", "--quiet"]) == 0  # nothing is to be compiled, and kept in a file, below
    assert command is not report or benchmark(one) == 0
    with largest_file(size):
        assert command(arguments) == 2
    printed = capsys.readouterr().err
    assert printed.count("\n") == 1 and "cannot write new/a." in printed and "File too large" in printed
    assert list((folder / "new").iterdir()) == []
