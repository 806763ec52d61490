"""The commands for a robot that is not simulated."""

import pytest

from drake_starnav.cli.drive import calibrate, drive, make_imported, replay, warm
from drake_starnav.errors import StarnavError

ROBOT = "tests.helpers.bare_robot:BareRobot"


@pytest.fixture(scope="module")
def log(tmp_path_factory):
    """The log of a drive of four seconds by the command."""
    pytest.importorskip("mcap")
    path = tmp_path_factory.mktemp("drive") / "run.mcap"
    code = drive(["forest", "--robot", ROBOT, "--option", "seed=1", "--log", str(path), "--seconds", "4", "--quiet"])
    assert code == 0
    return path


def test_a_drive_is_replayed(log, capsys) -> None:
    assert replay([str(log)]) == 0
    assert "commands are equal to the bit" in capsys.readouterr().out


def test_it_is_calibrated(log, tmp_path, capsys) -> None:
    out = tmp_path / "robot.yaml"
    assert calibrate([str(log), "--out", str(out)]) == 0
    assert "drive:" in out.read_text() and calibrate([str(log)]) == 0
    assert capsys.readouterr().out == out.read_text()


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["forest", "--robot", "nothing.here:Robot"], "No module named"),
        (["forest", "--robot", ROBOT, "--option", "seed"], "NAME=VALUE"),
        (["forest", "--robot", ROBOT, "--option", "colour=red"], "unexpected keyword argument"),
        (["forest", "--robot", ROBOT, "--goal", "1"], "X Y or X Y YAW"),
    ],
)
def test_what_is_refused(arguments, said, capsys) -> None:
    assert drive(arguments) == 2
    assert said in capsys.readouterr().err


def test_options_are_json_or_text() -> None:
    made_of = make_imported("builtins:dict", ["a=1", "b=[2, 3]", "c=text"])
    assert made_of == {"a": 1, "b": [2, 3], "c": "text"}
    with pytest.raises(StarnavError, match="robot ros: Empty module name|allowed: module:function"):
        make_imported("ros", [])


@pytest.mark.slow
def test_warm_says_how_long_it_takes(capsys) -> None:
    assert warm(["forest"]) == 0
    assert capsys.readouterr().out.count("ready after") == 2
