"""Macros of xacro are expanded within bounds of memory and time."""

from pathlib import Path

import pytest

from drake_starnav.errors import StarnavError
from drake_starnav.models import xacro_files
from drake_starnav.models.xacro_files import expand_macros

pytest.importorskip("xacro")
NAMESPACE = 'xmlns:xacro="http://ros.org/wiki/xacro"'


def written(folder: Path, content: str) -> Path:
    path = folder / "r.xacro"
    path.write_text(f'<robot name="r" {NAMESPACE}>{content}</robot>', encoding="utf-8")
    return path


def test_macros_are_expanded_with_arguments(tmp_path: Path) -> None:
    path = written(tmp_path, '<xacro:arg name="side" default="left"/><link name="$(arg side)_${2 + 3}"/>')
    assert b'<link name="right_5"/>' in expand_macros(path, {"side": "right"}, "robot model r")


@pytest.mark.parametrize("expression", ["9**9**9", "'a'*10**10", "len(list(range(10**9)))"])
def test_an_expression_without_bounds_is_refused(expression: str, tmp_path: Path, monkeypatch) -> None:
    monkeypatch.setattr(xacro_files, "MOST_TIME", 2)
    with pytest.raises(StarnavError, match=r"^robot model r: xacro: .*; allowed: a file that xacro expands"):
        expand_macros(written(tmp_path, f'<link name="${{{expression}}}"/>'), {}, "robot model r")


def test_macros_that_nest_without_bounds_are_refused(tmp_path: Path, monkeypatch) -> None:
    monkeypatch.setattr(xacro_files, "MOST_TIME", 2)
    macros = '<xacro:macro name="m0"><link name="l"/></xacro:macro>' + "".join(
        f'<xacro:macro name="m{k}">{f"<xacro:m{k - 1}/>" * 10}</xacro:macro>' for k in range(1, 9)
    )
    with pytest.raises(StarnavError, match="takes more than"):
        expand_macros(written(tmp_path, f"{macros}<xacro:m8/>"), {}, "robot model r")
