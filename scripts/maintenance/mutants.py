"""Small changes of a module: another operator, number or function, a condition that is dropped or never met."""

import ast
import difflib
import re
from collections.abc import Iterator
from typing import Any, NamedTuple

import parso
from cosmic_ray.ast import ast_nodes, get_ast
from cosmic_ray.mutating import mutate_code
from cosmic_ray.operators.operator import Operator
from cosmic_ray.plugins import get_operator, operator_names

SIMILAR = ({"Add", "Sub", "Mul", "Div"}, {"Mul", "Pow"}, {"Mod", "FloorDiv"}, {"BitOr", "BitAnd"})
"""Operators that may stand for each other; with others, most mutants fail on the types."""
EXCHANGED = ("min max", "minimum maximum", "any all", "floor ceil", "cos sin")


class DropOperand(Operator):
    """Leaves out a part of a condition."""

    def mutation_positions(self, node):
        if node.type in ("and_test", "or_test"):
            yield from ((operand.start_pos, operand.end_pos) for operand in node.children[::2])

    def mutate(self, node, index):
        first = max(2 * index - 1, 0)
        del node.children[first : first + 2]
        return node

    @classmethod
    def examples(cls):
        return ()


class NeverMet(DropOperand):
    """Leaves out what depends on a condition."""

    def mutation_positions(self, node):
        for keyword, condition in _pairs(node):
            yield condition.start_pos, condition.end_pos
            if keyword.value == "while":
                break

    def mutate(self, node, index):
        _, condition = list(_pairs(node))[index]
        node.children[node.children.index(condition)] = parso.parse(" False")
        return node


class Exchange(DropOperand):
    """Calls another function."""

    OTHERS = {name: other for pair in EXCHANGED for name, other in (pair.split(), pair.split()[::-1])}

    def mutation_positions(self, node):
        if node.type == "name" and node.value in self.OTHERS and node.get_next_leaf().value == "(":
            yield node.start_pos, node.end_pos

    def mutate(self, node, index):
        node.value = self.OTHERS[node.value]
        return node


class NotChanged(DropOperand):
    """Leaves out a change of a variable, as `x += 1`."""

    def mutation_positions(self, node):
        if node.type == "expr_stmt" and node.children[1].type == "operator" and len(node.children[1].value) > 1:
            yield node.start_pos, node.end_pos

    def mutate(self, node, index):
        del node.children[1:]
        return node


def _pairs(node) -> Iterator[tuple[Any, Any]]:
    """Keywords and conditions of a statement or an expression."""
    if node.type in ("if_stmt", "while_stmt", "ternary", "test"):
        for word, condition in zip(node.children, node.children[1:], strict=False):
            if getattr(word, "value", None) in ("if", "elif", "while"):
                yield word, condition


def operators() -> Iterator[Operator]:
    """What is applied, each wherever it can be."""
    for name in operator_names():
        kind, *pair = name.removeprefix("core/").split("_")
        swaps = any(set(pair) <= group for group in SIMILAR)
        compares = kind == "ReplaceComparisonOperator" and sum("Is" in side for side in pair) in (0, 2)
        drops = kind == "ReplaceUnaryOperator" and "Delete" in pair
        single = kind.startswith(("AddNot", "NumberReplacer", "ZeroIteration")) or "With" in kind
        if (kind == "ReplaceBinaryOperator" and swaps) or compares or drops or single:
            yield get_operator(name)()
    yield from (DropOperand(), NeverMet(), Exchange(), NotChanged())


class Mutant(NamedTuple):
    """The source of a module with one change: the line, and what was there before and is after, without indentation."""

    line: int
    before: str
    after: str
    source: str


def mutants(source: str) -> list[Mutant]:
    """All mutants of a module that compile and differ."""
    tree = ast.parse(source)
    declared = [(d.lineno, d.end_lineno or 0) for node in ast.walk(tree) for d in getattr(node, "decorator_list", ())]
    types = [a for node in ast.walk(tree) for a in (getattr(node, "annotation", None), getattr(node, "returns", None))]
    names = [((t.lineno, t.col_offset), (t.end_lineno, t.end_col_offset)) for t in types if t is not None]
    found = {}
    for position, changed in _changes(source):
        inert = any(a <= position[0] <= b for a, b in declared) or any(a <= position < b for a, b in names)
        if not inert and changed not in found and _compiles(changed):
            found[changed] = Mutant(position[0], *difference(source, changed), changed)
    return sorted((*found.values(), *_of_formulas(source, tree)), key=lambda mutant: mutant.line)


def _changes(source: str) -> Iterator[tuple[tuple[int, int], str]]:
    """Each change by each operator: its line and column, and the new source."""
    nodes = list(ast_nodes(get_ast(source)))
    for operator in operators():
        places = ((node, place) for node in nodes for place in operator.mutation_positions(node))
        for occurrence, (node, (begin, _)) in enumerate(places):
            if node.type == "operator" and node.parent.type in ("parameters", "param"):
                continue  # a lone star
            changed = mutate_code(source, operator, occurrence)
            if changed is not None and changed != source:
                yield begin, changed


def _of_formulas(source: str, tree: ast.Module) -> Iterator[Mutant]:
    """Mutants in which the text of an `ErrorTerm` is changed as if it were code."""
    terms = [c for c in ast.walk(tree) if isinstance(c, ast.Call) and getattr(c.func, "id", "") == "ErrorTerm"]
    values: dict[str, Any] = {}
    if terms:
        exec(compile(source, "formulas", "exec"), values)
    lines = source.splitlines(keepends=True)
    starts = [sum(map(len, lines[:k])) for k in range(len(lines))]
    for text in (term.args[0] for term in terms):
        formula = eval(compile(ast.Expression(text), "formula", "eval"), values)
        begin = starts[text.lineno - 1] + text.col_offset
        end = starts[(text.end_lineno or 0) - 1] + (text.end_col_offset or 0)
        for changed in dict.fromkeys(changed for _, changed in _changes(formula.replace("^", "**"))):
            after = changed.replace("**", "^").strip()
            yield Mutant(text.lineno, formula, _tidy(after), source[:begin] + repr(after) + source[end:])


def _tidy(text: str) -> str:
    """Without the spaces that the operators leave."""
    return re.sub(r"(?<=[(\[:]) +(?=[-\d])| +(?= )", "", text).strip()


def _compiles(source: str) -> bool:
    try:
        return compile(source, "mutant", "exec") is not None
    except SyntaxError:
        return False


def difference(source: str, changed: str) -> tuple[str, str]:
    """The lines that differ, joined."""
    old, new = source.splitlines(), changed.splitlines()
    for tag, a, b, c, d in difflib.SequenceMatcher(None, old, new, autojunk=False).get_opcodes():
        if tag != "equal":
            return " ".join(map(str.strip, old[a:b])), _tidy(" ".join(map(str.strip, new[c:d])))
    return "", ""
