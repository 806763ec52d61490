"""Shipped files are found in a checkout and in an installed package."""

from pathlib import Path

import pytest

from drake_starnav.errors import StarnavError
from drake_starnav.utils import resources
from drake_starnav.utils.resources import find_model_path, resolve_path


def test_installed_files_come_before_a_neighbour_named_models(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    installed, neighbour = tmp_path / "drake_starnav" / "share", tmp_path / "models"
    for folder in (installed, neighbour):
        folder.mkdir(parents=True)
        (folder / "package.xml").touch()
    monkeypatch.setattr(resources, "_FOLDERS", (installed, neighbour))
    assert find_model_path("robots") == installed / "robots"
    (installed / "package.xml").unlink()
    assert find_model_path("robots") == neighbour / "robots"


def test_models_left_behind(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr(resources, "_FOLDERS", (tmp_path / "share", tmp_path / "models"))
    with pytest.raises(StarnavError, match="no package.xml in .*share or .*models; allowed: "):
        find_model_path()


def test_paths_of_shipped_files_and_others() -> None:
    assert resolve_path("package://drake_starnav/maps/studio.yaml") == find_model_path("maps", "studio.yaml")
    assert resolve_path("maps/mine.yaml") == Path("maps/mine.yaml")
    with pytest.raises(StarnavError, match="package://other/x.yaml: allowed: a path, or package://drake_starnav/"):
        resolve_path("package://other/x.yaml")
