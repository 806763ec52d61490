"""What Numba compiles, and who says so."""

import numba
import pytest

from drake_starnav.utils.compilation import COMPILING, compilations, say_compiling


def test_what_numba_compiles_is_counted_and_nothing_else() -> None:
    counts: list[int] = []
    double = numba.njit(lambda x: 2 * x)
    with compilations(counts.append):
        assert double(1) == 2
        assert double(2) == 4
    double(1.5)
    assert counts == [0, 1]


def test_only_the_outermost_reports() -> None:
    outer: list[int] = []
    inner: list[int] = []
    double = numba.njit(lambda x: 2 * x)
    with compilations(outer.append), compilations(inner.append):
        double(1)
    with compilations(inner.append):
        double(1.0)
    assert (outer, inner) == ([0, 1], [0, 1])


def test_after_an_error_the_next_is_heard() -> None:
    counts: list[int] = []
    with pytest.raises(ValueError, match="ours"), compilations(counts.append):
        raise ValueError("ours")
    with compilations(counts.append):
        numba.njit(lambda x: 2 * x)(1)
    assert counts == [0, 1]


def test_a_process_says_it_once(capsys) -> None:
    say_compiling.cache_clear()
    for _ in range(2):
        with compilations():
            numba.njit(lambda x: 2 * x)(1)
            numba.njit(lambda x: x / 2)(1)
    assert capsys.readouterr().err == f"{COMPILING}\n"
