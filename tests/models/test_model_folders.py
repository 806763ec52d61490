"""Folders of models and packages are found where Gazebo and ROS look for them, and near the file that names them."""

from pathlib import Path

import pytest

from drake_starnav.models.model_folders import FOLDERS, find_file


@pytest.fixture(autouse=True)
def _no_environment(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in (*FOLDERS, "AMENT_PREFIX_PATH"):
        monkeypatch.delenv(name, raising=False)


def crate(folder: Path) -> Path:
    folder.mkdir(parents=True)
    (folder / "a b.dae").touch()
    return folder


@pytest.mark.parametrize("scheme", ["model", "package"])
@pytest.mark.parametrize("variable", [*FOLDERS, "AMENT_PREFIX_PATH"])
def test_models_are_found_where_the_environment_says(variable: str, scheme: str, tmp_path: Path, monkeypatch) -> None:
    folder = crate(tmp_path / ("a/share/crate" if variable == "AMENT_PREFIX_PATH" else "a/crate"))
    assert find_file(f"{scheme}://crate", tmp_path / "w") is None
    monkeypatch.setenv(variable, f"{tmp_path / 'none'}:{tmp_path / 'a'}:")
    assert find_file(f"{scheme}://crate", tmp_path / "w") == folder
    assert find_file(f"{scheme}://crate/a b.dae", tmp_path / "w") == folder / "a b.dae"


@pytest.mark.parametrize("place", ["w/crate", "crate", "models/crate", "w/models/crate"])
def test_models_are_found_near_the_file_that_names_them(place: str, tmp_path: Path) -> None:
    folder = crate(tmp_path / place)
    assert find_file("model://crate", tmp_path / "w") == folder
    assert find_file("model://crate", folder) == folder


def test_a_package_is_found_by_the_name_in_its_manifest(tmp_path: Path, monkeypatch) -> None:
    folder = crate(tmp_path / "a/b/c")
    (folder / "package.xml").write_text("<package><name>crate</name></package>")
    (tmp_path / "a/package.xml").write_text("not XML")
    monkeypatch.setenv("ROS_PACKAGE_PATH", str(tmp_path / "a"))
    assert find_file("package://crate", tmp_path / "w") == folder


@pytest.mark.parametrize(
    "uri", ["a b.dae", "a%20b.dae", " a b.dae ", "file://{}/a%20b.dae", "file://{}/a b.dae", "{}/a b.dae"]
)
def test_files_are_found_by_their_paths(uri: str, tmp_path: Path) -> None:
    folder = crate(tmp_path / "crate")
    assert find_file(uri.format(folder), folder) == folder / "a b.dae"


@pytest.mark.parametrize(
    "uri", ["", "gone", "model://", "model://gone/x", "https://a/b.dae", "x" * 5000, "a\0b", "loop"]
)
def test_what_is_not_there_is_not_found(uri: str, tmp_path: Path) -> None:
    (tmp_path / "loop").symlink_to("loop")
    found = find_file(uri, tmp_path)
    assert found is None or found.is_dir()
