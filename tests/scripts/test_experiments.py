"""The script that compares rules for the segments, on a few scans."""

import sys

from scripts.experiments import ablate_segments


def test_it_writes_table_and_picture(tmp_path, monkeypatch, capsys) -> None:
    name = "ablate_segments"
    monkeypatch.setattr(sys, "argv", [name, "--scans", "3", "--out", str(tmp_path / "new")])
    assert ablate_segments.main() == 0
    text = (tmp_path / "new" / f"{name}.md").read_text(encoding="utf-8")
    assert text in capsys.readouterr().out
    assert "3 scans" in text
    assert (tmp_path / "new" / f"{name}.png").read_bytes().startswith(b"\x89PNG")
