"""How a command ends."""

import pytest

from drake_starnav.console import BAD_INPUT, INTERRUPTED, exit_code
from drake_starnav.errors import StarnavError


def raising(error: BaseException) -> int:
    raise error


def test_a_command_ends_with_what_its_work_returns(capsys: pytest.CaptureFixture[str]) -> None:
    assert [exit_code("name", lambda k=k: k) for k in (0, 1)] == [0, 1]
    assert capsys.readouterr() == ("", "")


def test_bad_input_and_interruption_are_told_in_a_line(capsys: pytest.CaptureFixture[str]) -> None:
    assert exit_code("name", lambda: raising(StarnavError("x is 1; allowed: 2"))) == BAD_INPUT
    assert exit_code("name", lambda: raising(KeyboardInterrupt()), "interrupted; half is kept") == INTERRUPTED
    assert capsys.readouterr().err == "name: x is 1; allowed: 2\nname: interrupted; half is kept\n"


def test_other_errors_are_not_hidden() -> None:
    with pytest.raises(ValueError, match="ours"):
        exit_code("name", lambda: raising(ValueError("ours")))
