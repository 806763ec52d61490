"""Where files lie that models name by folders, as Gazebo and ROS look for them."""

import os
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from urllib.parse import unquote, urlsplit
from xml.etree import ElementTree

from drake_starnav.utils.resources import find_model_path

FOLDERS = ("GAZEBO_MODEL_PATH", "GZ_SIM_RESOURCE_PATH", "IGN_GAZEBO_RESOURCE_PATH", "SDF_PATH", "ROS_PACKAGE_PATH")
"""Environment variables that list folders with models and packages, separated by colons; beside AMENT_PREFIX_PATH."""


def find_file(uri: str, folder: Path) -> Path | None:
    """The file or folder that a name in a file in `folder` means; None if there is none on this machine."""
    scheme, has_scheme, rest = uri.strip().partition("://")
    if not has_scheme:
        possible_places: Iterator[Path] = iter((folder / unquote(uri.strip()), folder / uri.strip()))
    elif scheme == "file":
        possible_places = iter((Path(unquote(urlsplit(uri).path)), Path(rest), folder / rest))
    elif scheme in ("model", "package"):
        name, _, inner_path = rest.partition("/")
        possible_places = (found_place / inner_path for found_place in _find_folders_named(name, folder))
    else:
        possible_places = iter(())
    with suppress(OSError, RuntimeError, ValueError):  # too long, a loop of links, a null byte
        return next((place for place in possible_places if place.exists()), None)
    return None


def _find_folders_named(name: str, folder: Path) -> Iterator[Path]:
    """Folders of a model or package of that name: below those of the environment, above a file, and beside it."""
    for root in _list_roots():
        yield root / name
        if root.name == name:
            yield root
    if name == "drake_starnav":
        yield find_model_path()
    for above in (folder, *folder.parents):
        if above.name == name:
            yield above
        yield from (above / name, above / "models" / name)
    for root in _list_roots():
        for manifest in root.rglob("package.xml"):
            with suppress(OSError, ElementTree.ParseError):
                if ElementTree.fromstring(manifest.read_bytes()).findtext("name") == name:
                    yield manifest.parent


def _list_roots() -> list[Path]:
    """The folders that the environment names, in its order."""
    folder_names = [name for variable in FOLDERS for name in os.environ.get(variable, "").split(":")]
    folder_names += [f"{name}/share" for name in os.environ.get("AMENT_PREFIX_PATH", "").split(":") if name]
    return [Path(name).absolute() for name in folder_names if name]
