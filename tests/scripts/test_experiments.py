"""The scripts that draw the paper's figures and the benchmark's references, on a few scans."""

import sys

import pytest

from scripts.experiments import ablate_segments, compare_regions


@pytest.mark.parametrize("script", [ablate_segments, compare_regions], ids=lambda script: script.__name__)
def test_a_script_writes_table_and_picture(script, tmp_path, monkeypatch, capsys) -> None:
    name = script.__name__.rpartition(".")[2]
    monkeypatch.setattr(sys, "argv", [name, "--scans", "3", "--out", str(tmp_path / "new")])
    assert script.main() == 0
    text = (tmp_path / "new" / f"{name}.md").read_text(encoding="utf-8")
    assert text in capsys.readouterr().out
    assert "3 scans" in text
    assert (tmp_path / "new" / f"{name}.png").read_bytes().startswith(b"\x89PNG")
