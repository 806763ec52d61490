"""Model files as they are found, brought into a form of which Drake's parser leaves nothing out.

Gazebo's worlds hold more than bodies, name models by folders and have meshes in any format. What is read is written
to a temporary folder: bodies, joints and shapes alone, with absolute paths; meshes that Drake does not read, cones and
extruded polylines as OBJ files, one for each connected piece, with whose convex hull Drake collides, and for each
colour of what is only seen.
"""

import math
import re
from collections.abc import Iterable, Iterator, Mapping
from copy import deepcopy
from pathlib import Path
from typing import Any
from xml.etree import ElementTree
from xml.etree.ElementTree import Element, SubElement

from drake_starnav.errors import StarnavError, said_by, shown
from drake_starnav.models.model_folders import FOLDERS, find_file
from drake_starnav.models.obj_files import SOLIDS, check_faces, convert_mesh, paint_surfaces, write, write_obj
from drake_starnav.models.xacro_files import expand_macros
from drake_starnav.utils.files import explain_missing_file, explain_read_errors, read_bytes

DRAKE_NAMESPACE = "http://drake.mit.edu"
CONVERTED_MESHES = (".dae", ".stl")
SHOWN_BY_DRAKE, CONVERTED_VISUALS = (".obj", ".gltf"), (".dae", ".stl", ".glb")
"""Visual meshes: those that Drake's Meshcat shows, and those that are converted."""
EVERYWHERE = ("sun", "ground_plane")
"""Included models without which no world of Gazebo's is: there is a floor and light already."""
HAS_MACROS = re.compile(rb"<xacro:|\$[{(]")
MOST_LINKS = 2000
"""Links of a model with all that it includes: a few small files that include each other may mean millions."""
LARGEST_LENGTH = 1e6
"""The largest coordinate or extent in a model, m."""
_PRIMITIVES = {"box", "sphere", "cylinder", "capsule", "ellipsoid", "empty"}
_NUMBERS = ("xyz", "rpy", "pose", "size", "radius", "radii", "length", "scale", "normal")
"""Attributes in URDF and elements in SDF that hold numbers of a look."""
_OF_WORLD = {"world", "model", "include", "frame", "joint"}
_KEPT_ELEMENTS = {
    "sdf": {"world", "model"},
    "world": _OF_WORLD,
    "model": {"model", "include", "frame", "joint", "link", "pose", "static", "self_collide"},
    "link": {"pose", "inertial", "collision", "visual", "gravity"},
    "collision": {"pose", "geometry", "surface"},
    "surface": {"friction"},
    "ode": {"mu", "mu2"},
    "visual": {"pose", "geometry", "material"},
    "material": {"ambient", "diffuse", "specular", "emissive"},
}
"""The parts of these elements of SDF that concern bodies."""


class Models:
    """Reads model files; `unseen` are visual meshes that are not shown, each with the reason."""

    def __init__(self, *, weld: bool = False) -> None:
        """`weld`: whether bodies that no joint holds will not move."""
        self.unseen: set[str] = set()
        self._weld = weld
        self._open: list[Path] = []
        self._written: dict[str, Path] = {}
        self._adapted: dict[Path, tuple[Path, int]] = {}
        self._links = 0

    def restore_names(self, text: str) -> str:
        """A message of Drake's with the names of the files as they were found."""
        for name, path in self._written.items():
            text = text.replace(name, str(path))
        return text

    def directives(self, text: str, folder: Path) -> str:
        """Model directives whose files are replaced by what Drake reads; those of Drake's own packages stay."""

        def replaced(match: re.Match[str]) -> str:
            path = find_file(match[2], folder)
            return match[0] if path is None else f'{match[1]}"file://{self.model(path)}"'

        return re.sub(r"""(\bfile\s*:\s*)["']?([^\s"',}]+)["']?""", replaced, text)

    def model(self, path: Path) -> Path:
        """The file to hand to Drake instead of a model directives, SDF, URDF or other file.

        Raises:
            StarnavError: a file is missing or broken, or holds a shape that cannot be built.
        """
        path = path.resolve()
        if path in self._open or len(self._open) >= 50:
            raise StarnavError(f"model {path} includes itself; allowed: files that do not")
        if path in self._adapted:
            adapted_model, links = self._adapted[path]
            self._add_links(links, path)
            return adapted_model
        self._open.append(path)
        links_before = self._links
        try:
            file_content = self._read_bytes(path, "model")
            if path.name.endswith((".dmd.yaml", ".yaml")):
                model_text, suffix = self.directives(file_content.decode("utf-8", "replace"), path.parent), ".dmd.yaml"
            elif path.suffix.lower() in (".sdf", ".world", ".urdf", ".xacro"):
                root = self._parse_model(expand_model_file(file_content, path, {}, f"model {path}"), path)
                if root.tag == "robot":
                    self.make_urdf_readable(root, path)
                else:
                    self._convert_sdf(root, path)
                model_text = ElementTree.tostring(root, encoding="unicode")
                suffix = ".urdf" if root.tag == "robot" else ".sdf"
            else:
                return path  # in a format of which Drake reads all or nothing
        except RecursionError:
            raise StarnavError(f"model {path} is nested too deeply; allowed: what Drake's parser reads") from None
        finally:
            self._open.pop()
        written_file = write(model_text.encode(), suffix)
        self._written[str(written_file)] = path
        self._adapted[path] = written_file, self._links - links_before
        return written_file

    def _add_links(self, count: int, path: Path) -> None:
        """Count the links of a file, and the file itself, each time that it is included."""
        self._links += count
        if self._links > MOST_LINKS:
            raise StarnavError(
                f"model {path} makes more than {MOST_LINKS} links, with those that it includes or stands beside; "
                f"allowed: at most {MOST_LINKS}"
            )

    def make_urdf_readable(self, root: Element, path: Path) -> None:
        """Let all links of a robot collide with shapes that Drake reads, and have no looks that it does not."""
        self._add_links(1 + sum(1 for _ in root.iter("link")), path)
        self._keep_readable_looks(root)
        self._color_by_name(root)
        for link in root.iter("link"):
            for visual in link.findall("visual"):
                mesh, has_no_color = visual.find("geometry/mesh"), visual.find("material") is None
                if mesh is None:
                    continue
                for copy, uri, color in self._convert_looks(visual, link, mesh.get("filename", ""), path.parent):
                    copy.find("geometry/mesh").set("filename", uri)  # type: ignore[union-attr]
                    if has_no_color and color:
                        SubElement(SubElement(copy, "material", name=f"colour {color}"), "color", rgba=color)
            for collision in link.findall("collision"):
                mesh = collision.find("geometry/mesh")
                if mesh is None:
                    continue
                pieces = self._convert_pieces(
                    mesh.get("filename", ""), path.parent, f"model {path}: link {link.get('name')}"
                )
                for copy, piece in _copy_for_pieces(collision, link, pieces):
                    copy.find("geometry/mesh").set("filename", piece)  # type: ignore[union-attr]

    def _keep_readable_looks(self, root: Element) -> None:
        """Give each look a colour that Drake reads, white for any other; drop a look of which a number is none."""
        for color in root.iter("color"):
            color.set("rgba", self._read_color(color.get("rgba", ""), (4,)))
        for part in (part for material in root.iter("material") for part in material):
            if part.tag in _KEPT_ELEMENTS["material"]:
                part.text = self._read_color(part.text or "", (3, 4))
        for link in root.iter("link"):
            for visual in link.findall("visual"):
                visual_text = " ".join(each.get(key, "") for each in visual.iter() for key in _NUMBERS)
                visual_text += "".join(f" {each.text or ''}" for each in visual.iter() if each.tag in _NUMBERS)
                if not all(math.isfinite(_read_number(word)) for word in visual_text.split()):
                    link.remove(visual)
                    self.unseen.add(f"a look of link {link.get('name')} (a number is not finite)")

    def _read_color(self, color_text: str, counts: tuple[int, ...]) -> str:
        """Return a colour as it is said; white for one of another count of numbers, or with others."""
        if len(color_text.split()) in counts and all(0.0 <= _read_number(word) <= 1.0 for word in color_text.split()):
            return color_text
        self.unseen.add(f"colour {shown(color_text)} (allowed: {counts[-1]} numbers from 0 to 1)")
        return "1 1 1 1"

    def _color_by_name(self, root: Element) -> None:
        """Give each look of a robot the colour of its material's name, or of SDF's words; white where none is said."""
        colors: dict[str | None, Element] = {}
        for material in root.iter("material"):
            for color in material.findall("color"):
                colors[material.get("name")] = color
        for link in root.iter("link"):
            for visual in link.findall("visual"):
                for material in visual.findall("material"):
                    own = material.find("color")
                    if own is None and material.find("texture") is None:  # Drake refuses it
                        known_color = colors.get(material.get("name"))
                        diffuse = (material.findtext("diffuse") or "").split() or "111"
                        rgba = " ".join((*diffuse, "1")[:4]) if known_color is None else known_color.get("rgba", "")
                        own = SubElement(material, "color", rgba=rgba)
                    if own is not None:  # under a name of its own: one name may have several colours
                        material.set("name", f"{material.get('name', '')} {own.get('rgba')}")

    def _convert_sdf(self, root: Element, path: Path) -> None:
        if root.tag != "sdf":
            raise StarnavError(f"model {path} begins with <{shown(root.tag)}>; allowed: <sdf> or <robot>")
        self._add_links(1 + sum(1 for _ in root.iter("link")), path)
        _remove_unread_parts(root, path)
        for parent in root.iter():
            for include in parent.findall("include"):
                if _find_included_name(include).lower().replace(" ", "_") in EVERYWHERE:
                    parent.remove(include)
        for world in root.iter("world"):
            self._name_apart(world)
        for include in root.iter("include"):
            self._include(include, path)
        for model in (*root.findall("model"), *root.findall("world/model")):
            has_joints = next(model.iter("joint"), None) is not None
            if model.findtext("static", "0").strip() in ("1", "true") or (self._weld and not has_joints):
                for link in model.iter("link"):
                    for inertial in link.findall("inertial"):  # often not valid, as Gazebo takes no notice of it
                        link.remove(inertial)
        for link in root.iter("link"):
            for visual in link.findall("visual"):
                mesh, has_no_color = visual.find("geometry/mesh/uri"), visual.find("material") is None
                if mesh is None:
                    continue
                for copy, uri, color in self._convert_looks(visual, link, mesh.text or "", path.parent):
                    copy.find("geometry/mesh/uri").text = uri  # type: ignore[union-attr]
                    if has_no_color and color:
                        SubElement(SubElement(copy, "material"), "diffuse").text = color
            for collision in link.findall("collision"):
                self._convert_collision(link, collision, path)

    def _name_apart(self, world: Element) -> None:
        """Number the models of a world that have one name, as Gazebo does."""
        taken_names: set[str] = set()
        for model in world:
            if model.tag not in ("model", "include"):
                continue
            name = model.get("name") if model.tag == "model" else model.findtext("name")
            if name is None:
                name = _find_included_name(model)
            name_number, free_name = 0, name
            while free_name in taken_names:
                name_number += 1
                free_name = f"{name}_{name_number}"
            taken_names.add(free_name)
            if model.tag == "model":
                model.set("name", free_name)
            elif model.find("name") is not None:
                model.find("name").text = free_name  # type: ignore[union-attr]
            else:
                SubElement(model, "name").text = free_name

    def _include(self, include: Element, path: Path) -> None:
        uri = include.findtext("uri") or ""
        found_folder = find_file(uri, path.parent) or find_file(f"model://{_find_included_name(include)}", path.parent)
        if found_folder is None:
            raise StarnavError(
                f"model {path}: include {shown(uri.strip())} is not found; allowed: a file, or the name of a folder "
                f"beside it or in {', '.join(FOLDERS[:4])} or {FOLDERS[4]}"
            )
        if found_folder.is_dir():
            found_folder = self._find_model_file(found_folder)
        include.find("uri").text = f"file://{self.model(found_folder)}"  # type: ignore[union-attr]
        for plugin in include.findall("plugin"):
            include.remove(plugin)

    def _find_model_file(self, folder: Path) -> Path:
        """The model file of a folder, that of the highest version if there are several."""
        config_file, versioned_names = folder / "model.config", []
        if config_file.is_file():
            root = self._parse_model(self._read_bytes(config_file, "model"), config_file)
            for entry in root.iter("sdf"):
                version = tuple(int(part) for part in re.findall(r"\d+", entry.get("version", "")))
                versioned_names.append((version, (entry.text or "").strip()))
        file_name = max(versioned_names)[1] if versioned_names else "model.sdf"
        return folder / file_name

    def _convert_collision(self, link: Element, collision: Element, path: Path) -> None:
        geometry = collision.find("geometry")
        place = f"model {path}: collision {collision.get('name')}"
        if geometry is None:
            raise StarnavError(f"{place} has no geometry; allowed: a shape")
        if len(geometry) > 1:  # of which Drake takes the first
            raise StarnavError(f"{place} has {len(geometry)} shapes; allowed: one, and a collision for each other")
        for shape in list(geometry):
            if shape.tag == "mesh":
                if shape.find("submesh") is not None:
                    raise StarnavError(f"{place} is a part of a mesh; allowed: a mesh file of its own")
                pieces = self._convert_pieces(shape.findtext("uri") or "", path.parent, place)
            elif shape.tag in SOLIDS:
                try:
                    meshes = SOLIDS[shape.tag](shape)
                except (ValueError, StarnavError) as error:
                    raise StarnavError(f"{place}: {shape.tag}: {said_by(error)}; allowed: a solid shape") from None
                pieces = [write_obj(*mesh) for mesh in meshes]
                geometry.clear()
                SubElement(SubElement(geometry, "mesh"), "uri")
            elif shape.tag.rpartition("}")[2] in _PRIMITIVES:
                continue
            else:
                solids = "box, sphere, cylinder, capsule, ellipsoid, cone, polyline, plane or mesh"
                raise StarnavError(f"{place} is a {shape.tag}; allowed: {solids}")
            for copy, piece in _copy_for_pieces(collision, link, pieces):
                copy.find("geometry/mesh/uri").text = piece  # type: ignore[union-attr]

    def _convert_pieces(self, uri: str, folder: Path, place: str) -> list[Path]:
        """The files to collide with instead of a mesh file."""
        path = find_file(uri, folder)
        fault = explain_missing_file(path)
        if path is None or fault:
            raise StarnavError(f"{place}: mesh {shown(uri.strip())}: {fault}; allowed: a mesh file")
        suffix = path.suffix.lower()
        if suffix not in (*CONVERTED_MESHES, ".obj"):
            return [path.resolve()]
        file_content = self._read_bytes(path, "mesh")
        try:
            if suffix == ".obj":
                check_faces(file_content)
                return [path.resolve()]
            return list(convert_mesh(file_content, suffix))
        except StarnavError as error:
            raise StarnavError(f"mesh {path}: {error}; allowed: a whole {suffix} file") from None

    def _convert_looks(
        self, visual: Element, link: Element, uri: str, folder: Path
    ) -> Iterator[tuple[Element, str, str]]:
        """A visual element of the link for each surface of a mesh file, the surface's URI, and the colour that the file
        gives it, if any, as four numbers; without one that can be shown the element is removed."""
        path = find_file(uri, folder)
        colored_parts: tuple[tuple[Path, tuple[float, ...] | None], ...] = ()
        file_suffix, why = "" if path is None else path.suffix.lower(), explain_missing_file(path)
        if path is not None and not why and file_suffix in SHOWN_BY_DRAKE:
            colored_parts = ((path.resolve(), None),)
        elif path is not None and not why and file_suffix in CONVERTED_VISUALS:
            try:
                colored_parts = paint_surfaces(self._read_bytes(path, "mesh"), file_suffix, path.parent)
            except StarnavError as error:
                why = str(error)
        if not colored_parts:
            link.remove(visual)
            self.unseen.add(f"{uri.strip()} ({why or 'no surface that can be shown'})")
        copies = list(_copy_for_pieces(visual, link, [part for part, _ in colored_parts]))
        for (copy, name), (_, color) in zip(copies, colored_parts, strict=True):
            yield copy, name, " ".join(f"{c:g}" for c in color or ())

    def _read_bytes(self, path: Path, what: str) -> bytes:
        return read_bytes(path, f"{what} {path}", "a file")

    def _parse_model(self, data: bytes, path: Path) -> Element:
        with explain_read_errors(f"model {path}", "XML"):
            root = parse_xml(data)
        self._keep_readable_looks(root)
        check_lengths(root, f"model {path}")
        return root


def expand_model_file(data: bytes, path: Path, arguments: Mapping[str, Any], place: str) -> bytes:
    """The content of a model file, with its macros of xacro expanded if it has any; errors as of `expand_macros`."""
    if HAS_MACROS.search(re.sub(rb"<!--.*?-->", b"", data, flags=re.DOTALL)):
        return expand_macros(path, arguments, place)
    if arguments:
        raise StarnavError(
            f"robot.xacro_args is {shown(arguments)} with the model {path}, which has no macros of xacro; allowed: none"
        )
    return data


def parse_xml(data: bytes) -> Element:
    """The root of an XML file, which need not declare the prefix `drake`: Drake takes it as it is."""
    ElementTree.register_namespace("drake", DRAKE_NAMESPACE)  # Drake reads the prefix, not the namespace
    if b"<xacro:" in re.sub(rb"<!--.*?-->", b"", data, flags=re.DOTALL):
        raise ElementTree.ParseError("it has macros of xacro, which are still to be expanded")
    if b"<drake:" in data and b"xmlns:drake" not in data:
        data = re.sub(rb"<(robot|sdf)\b", rb'<\1 xmlns:drake="%s"' % DRAKE_NAMESPACE.encode(), data, count=1)
    return ElementTree.fromstring(data)


def check_lengths(root: Element, place: str) -> None:
    """Raise `StarnavError` for a pose or shape that reaches farther than `LARGEST_LENGTH`; `place` names the file."""
    for part in root.iter():
        for element in part.iter() if part.tag in ("pose", "origin", "geometry") else ():
            for word in " ".join((element.text or "", *element.attrib.values())).split():
                if not _read_length(word) <= LARGEST_LENGTH:
                    raise StarnavError(
                        f"{place} has {shown(word)} in <{part.tag}>; allowed: at most {LARGEST_LENGTH:g} m"
                    )


def _read_length(word: str) -> float:
    """Return the size of a number; 0 of other words."""
    try:
        return abs(float(word))
    except ValueError:
        return 0.0


def _read_number(word: str) -> float:
    """Return a number; NaN of other words."""
    try:
        return float(word)
    except ValueError:
        return math.nan


def _remove_unread_parts(root: Element, path: Path) -> None:
    """Leave of elements of SDF the parts in `_KEPT_ELEMENTS` and those of Drake's own."""
    for element in list(root.iter()):
        kept_tags = _KEPT_ELEMENTS.get(element.tag)
        if kept_tags is None:
            continue
        for part in list(element):
            if part.tag not in kept_tags and not part.tag.startswith(f"{{{DRAKE_NAMESPACE}}}"):
                if part.tag == "population":
                    raise StarnavError(f"model {path} has a <population>; allowed: its models one by one")
                element.remove(part)


def _find_included_name(include: Element) -> str:
    return (include.findtext("uri") or "").strip().rstrip("/").rpartition("/")[2]


def _copy_for_pieces(element: Element, link: Element, pieces: Iterable[Path]) -> Iterator[tuple[Element, str]]:
    """An element of the link for each piece of its mesh, and the piece's URI; all but the first are copies."""
    for k, piece in enumerate(pieces):
        piece_element = element
        if k > 0:
            piece_element = deepcopy(element)
            piece_element.set("name", f"{element.get('name', element.tag)}_{k}")
            link.append(piece_element)
        yield piece_element, f"file://{piece}"
