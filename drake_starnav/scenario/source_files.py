"""The files from which a scenario's world and robot are made: those it names, and all that these name in turn."""

import json
import os
import re
from collections.abc import Iterator
from html import unescape
from pathlib import Path
from urllib.parse import unquote, urlsplit
from xml.etree import ElementTree

from drake_starnav.errors import StarnavError
from drake_starnav.scenario.schema import Scenario, scenario_path
from drake_starnav.utils.files import read_text
from drake_starnav.utils.resources import PACKAGE_URI, resolve_path
from drake_starnav.utils.yaml_text import yaml_texts
from drake_starnav.worlds.formats.world_file import shipped_file

FOLDER_FILES = ("model.config", "model.sdf", "package.xml")
"""The files that represent a folder named by a model."""


def input_files(name_or_path: str, scenario: Scenario) -> set[Path]:
    """All files that are read for a scenario loaded by a name or path; none of them may be overwritten."""
    return {scenario_path(name_or_path), *source_files(scenario)}


def source_files(scenario: Scenario) -> set[Path]:
    """The files that a scenario's world and robot are made from, by their real paths: models, maps, meshes, textures.

    A file counts as one of them if another of them names it, relative to itself, as a URI, or as part of a ROS package.
    """
    names = [value for value in (*vars(scenario.world).values(), scenario.robot.model) if isinstance(value, str)]
    names += [text for name in names if "\n" in name for text in yaml_texts(name)]
    waiting = [path for name in names for path in _named(name, Path.cwd())]
    found: set[Path] = set()
    while waiting:
        path = waiting.pop()
        if path not in found:
            found.add(path)
            waiting += [other for name in _names_in(path) for other in _named(name, path.parent)]
    return found


def _named(name: str, folder: Path) -> Iterator[Path]:
    """The readable file that a name in a file in `folder` may mean, or those that stand for a folder, if any."""
    for place in _places(name, folder):
        try:
            path = place.resolve()
            files = [path] if path.is_file() else [path / part for part in FOLDER_FILES if (path / part).is_file()]
        except (OSError, RuntimeError, ValueError):  # too long, a loop of links, a null byte
            continue
        yield from (file for file in files if os.access(file, os.R_OK))


def _places(name: str, folder: Path) -> Iterator[Path]:
    scheme, slashes, rest = name.partition("://")
    if not slashes:
        yield folder / name
        if "%" in name:
            yield folder / unquote(name)
        if shipped := shipped_file(name):
            yield shipped
    elif name.startswith(PACKAGE_URI):
        try:
            yield resolve_path(name)
        except StarnavError:
            return
    elif scheme == "file":
        yield Path(unquote(urlsplit(name).path))
        yield Path(rest)
    elif scheme in ("package", "model"):
        package, _, inside = rest.partition("/")
        yield from (found / inside for found in _packages(package, folder))


def _packages(name: str, folder: Path) -> Iterator[Path]:
    """Folders of a ROS package, or of a model of that name: above a file, or below the places that ROS names."""
    yield from (above for above in (folder, *folder.parents) if above.name == name)
    yield from (above / name for above in (folder, *folder.parents))
    for root in filter(None, os.environ.get("ROS_PACKAGE_PATH", "").split(":")):
        for manifest in Path(root).rglob("package.xml"):
            if _package_name(manifest) == name or manifest.parent.name == name:
                yield manifest.parent


def _package_name(manifest: Path) -> str | None:
    try:
        return ElementTree.fromstring(read_text(manifest)).findtext("name")
    except (OSError, ElementTree.ParseError):
        return None


def _names_in(path: Path) -> Iterator[str]:
    """All that may be the name of a file in a file of a format that names others."""
    readers = {
        ".yaml": yaml_texts, ".yml": yaml_texts, ".sdf": _xml_texts, ".urdf": _xml_texts, ".xml": _xml_texts,
        ".world": _xml_texts, ".config": _xml_texts, ".obj": _obj_texts, ".mtl": _mtl_texts, ".gltf": _gltf_texts,
    }  # fmt: skip
    if reader := readers.get(path.suffix.lower()):
        try:
            yield from reader(read_text(path))
        except OSError:
            return


def _xml_texts(text: str) -> Iterator[str]:
    """Texts and attributes; each also below the folders that a MuJoCo model names for its meshes and textures.

    Not by a parser: Drake also reads what is not quite XML, as URDF files with undeclared prefixes.
    """
    found = re.findall(r"""=\s*"([^"]*)"|=\s*'([^']*)'|>([^<]+)<|<!\[CDATA\[(.*?)\]\]>""", text)
    folders = re.findall(r"""(?:meshdir|texturedir|assetdir)\s*=\s*["']([^"']*)""", text)
    for value in filter(None, (unescape("".join(parts)).strip() for parts in found)):
        yield value
        yield from (f"{folder}/{value}" for folder in folders)


def _obj_texts(text: str) -> Iterator[str]:
    for line in re.findall(r"^[ \t]*mtllib[ \t]+(.+?)[ \t\r]*$", text, re.MULTILINE):
        yield line
        yield from line.split()


def _mtl_texts(text: str) -> Iterator[str]:
    """Of lines as `map_Kd -s 1 1 1 wood.png`: all that a name with spaces might be."""
    for line in re.findall(r"^[ \t]*(?:map_\w+|bump|disp|decal|refl|norm)[ \t]+(.+?)[ \t\r]*$", text, re.MULTILINE):
        words = line.split(" ")
        yield from (" ".join(words[k:]) for k in range(len(words)))


def _gltf_texts(text: str) -> Iterator[str]:
    try:
        content = json.loads(text)
    except (ValueError, RecursionError):
        return
    for part in ("buffers", "images"):
        entries = content.get(part) if isinstance(content, dict) else None
        for entry in entries if isinstance(entries, list) else []:
            uri = entry.get("uri") if isinstance(entry, dict) else None
            if isinstance(uri, str) and not uri.startswith("data:"):
                yield uri
