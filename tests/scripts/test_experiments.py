"""The script that compares rules for the segments, on a few scans."""

import sys

from scripts.experiments import ablate_segments


def test_it_prints_a_row_for_each_rule(monkeypatch, capsys) -> None:
    monkeypatch.setattr(sys, "argv", ["ablate_segments.py", "--scans", "3"])
    assert ablate_segments.main() == 0
    rows = capsys.readouterr().out.splitlines()[2:]
    assert [row.split("|")[1].strip() for row in rows] == list(ablate_segments.methods())
