"""The table of steps a second."""

from benchmarks import learning


def test_all_environments_are_stepped() -> None:
    _, _, *rows = learning.measure(2, 1).splitlines()
    assert [row.split("|")[1].split()[0] for row in rows] == ["1", "1", "1", "1", "2", "2"]
    assert all(float(cell) > 0.0 for row in rows for cell in row.split("|")[2:-1])
