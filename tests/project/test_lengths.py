"""No length is tuned for one robot: a constant in metres says why no robot, lidar or speed decides it."""

import ast
import re
from pathlib import Path

import pytest

PACKAGE = Path(__file__).resolve().parents[2] / "drake_starnav"
ROOMS = ("localization", "tracking", "planning", "control", "surroundings", "safety", "robot", "systems")
IN_METRES, REASON = re.compile(r",\s+m\b(?![/^])"), re.compile(r"\b(nature|numerics)\b")


def unfounded(text: str) -> list[str]:
    """Constants of numbers whose text names metres, where neither it nor the module's names a reason."""
    tree = ast.parse(text)
    if REASON.search(ast.get_docstring(tree) or ""):
        return []
    found, waiting = [], []
    for node in tree.body:
        if isinstance(node, ast.Assign) and isinstance(node.value, (ast.Constant, ast.Tuple, ast.BinOp, ast.UnaryOp)):
            waiting.append(ast.unparse(node.targets[0]))
            continue
        if isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant):
            said = str(node.value.value)
            found += waiting if IN_METRES.search(said) and not REASON.search(said) else []
        waiting = []
    return found


@pytest.mark.parametrize("room", ROOMS)
def test_a_constant_in_metres_is_of_nature_or_numerics(room: str) -> None:
    files = sorted((PACKAGE / room).glob("*.py"))
    assert {path.name: names for path in files if (names := unfounded(path.read_text(encoding="utf-8")))} == {}


def test_a_length_without_a_reason_is_found() -> None:
    assert unfounded('A = 0.1\nB = 2.0\n"""How far, m, and how often."""\nC = 1\n"""Of the robot, in radii."""\n') == [
        "A",
        "B",
    ]
    assert unfounded('A = 0.1\n"""How far, m: numerics."""\n') == []
