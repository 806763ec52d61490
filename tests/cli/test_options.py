"""How a command ends."""

import os
import subprocess
import sys
import warnings
from pathlib import Path

import pytest

from drake_starnav.cli.options import (
    BAD_INPUT,
    INTERRUPTED,
    find_program_name,
    format_typed_command,
    format_warnings_plainly,
    run_for_exit_code,
)
from drake_starnav.errors import StarnavError


def raising(error: BaseException) -> int:
    raise error


def test_bad_input_and_interruption_are_reported_in_a_line(capsys: pytest.CaptureFixture[str]) -> None:
    assert run_for_exit_code("name", lambda: raising(StarnavError("x is 1; allowed: 2"))) == BAD_INPUT
    assert run_for_exit_code("name", lambda: raising(KeyboardInterrupt("half is kept"))) == INTERRUPTED
    assert capsys.readouterr().err == "name: x is 1; allowed: 2\nname: interrupted; half is kept\n"


def test_a_warning_for_the_user_is_a_line_without_code() -> None:
    before = warnings.formatwarning
    with format_warnings_plainly("name"):
        held = warnings.formatwarning("held still:\narm", UserWarning, "file.py", 7)
        assert held == "name: warning: held still:\\narm\n"
        assert warnings.formatwarning("held still:\narm", UserWarning, "other.py", 9) == ""  # it has been said
        assert "file.py:7: DeprecationWarning: old" in warnings.formatwarning("old", DeprecationWarning, "file.py", 7)
    assert warnings.formatwarning is before


@pytest.mark.parametrize(
    ("called", "program"), [("/venv/bin/starnav", "starnav"), ("/package/__main__.py", "python -m drake_starnav")]
)
def test_the_program_has_the_name_it_was_called_by(called: str, program: str, monkeypatch) -> None:
    monkeypatch.setattr(sys, "argv", [called, "forest"])
    assert find_program_name() == program


@pytest.mark.parametrize(
    ("called", "prog", "typed"),
    [
        ("/usr/bin/starnav", "starnav benchmark", "starnav benchmark forest --html 'my page.html'"),
        ("experiments/ablate.py", "ablate.py", "python experiments/ablate.py forest --html 'my page.html'"),
    ],
)
def test_a_command_line_is_known_as_it_was_typed(called: str, prog: str, typed: str, monkeypatch) -> None:
    monkeypatch.setattr("sys.argv", [called])
    assert format_typed_command(prog, ["forest", "--html", "my page.html"]) == typed


def test_a_reader_that_has_gone_is_no_error() -> None:
    code = "import sys\nfrom drake_starnav.cli.options import run_for_exit_code\n"
    code += "def work():\n    for _ in range(100_000): print('a line')\n    return 0\n"
    code += "sys.exit(run_for_exit_code('x', work))"
    done = subprocess.run(
        ["bash", "-c", '"$0" -c "$1" | head -1; echo ${PIPESTATUS[0]}', sys.executable, code],
        capture_output=True, text=True, check=True,
        env={**os.environ, "PYTHONPATH": str(Path(__file__).parents[2])},
    )  # fmt: skip
    assert done.stdout.split() == ["a", "line", "1"]
    assert done.stderr == ""
