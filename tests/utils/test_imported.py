"""Names that users give as module:function."""

import math

import pytest

from drake_starnav import StarnavError
from drake_starnav.utils.imported import import_named


def test_a_module_beside_the_user_is_found(tmp_path, monkeypatch) -> None:
    (tmp_path / "robot_of_mine.py").write_text("def make():\n    return 3\n")
    monkeypatch.chdir(tmp_path)
    assert import_named("robot", "robot_of_mine:make")() == 3
    assert import_named("base", "math:hypot") is math.hypot


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("nowhere_at_all:make", "robot 'nowhere_at_all:make': No module named 'nowhere_at_all'; allowed"),
        ("math:hypott", "has no attribute 'hypott'; allowed: module:function"),
        ("math", "allowed: module:function"),
        ("", "allowed: module:function"),
        ("math:pi", "robot 'math:pi' is 3.14159.*; allowed: a function, or a class"),
    ],
)
def test_what_cannot_be_called_is_named(name, said) -> None:
    with pytest.raises(StarnavError, match=said):
        import_named("robot", name)
