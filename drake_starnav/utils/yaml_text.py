"""YAML of plain values and tagged mappings, as `world: !Forest {width: 20}`."""

import math
import re
from collections.abc import Iterable
from typing import Any

import yaml

from drake_starnav.errors import StarnavError, said_by, shown

OTHER_BREAKS = "\x85\u2028\u2029"
"""Line breaks of YAML that are only kept where they are escaped."""


_Loader: type = getattr(yaml, "CSafeLoader", yaml.SafeLoader)  # the one in C is much faster


class PlainLoader(_Loader):
    """Makes numbers, texts, lists and mappings; of other tags only what a subclass adds."""


PlainLoader.add_implicit_resolver(  # as in YAML 1.2; 1.1 reads 1e-3 and -.25 as texts
    "tag:yaml.org,2002:float",
    re.compile(r"[-+]?((\d[\d_]*\.?[\d_]*|\.\d[\d_]*)[eE][-+]?\d+|\.\d[\d_]*)$"),
    list("-+.0123456789"),
)
MOST_VALUES = 1_000_000
"""Values in a YAML text whose aliases are written out: a few short lines may mean more than the memory holds."""


def load_yaml(text: str, place: str, loader: type = PlainLoader) -> Any:
    """The content of a YAML text of one document, by `PlainLoader` or a subclass; `place` names it in messages.

    Raises:
        StarnavError: it is not valid YAML.
    """
    try:
        reader = loader(text)
        try:
            root_node = reader.get_single_node()
            if "*" in text and root_node is not None:
                _count_values(root_node, {})
            return None if root_node is None else reader.construct_document(root_node)
        finally:
            reader.dispose()
    except yaml.YAMLError as error:
        problem_mark = getattr(error, "problem_mark", None)
        place_text = f" line {problem_mark.line + 1}, column {problem_mark.column + 1}" if problem_mark else ""
        reason = getattr(error, "problem", None) or error
    except (ValueError, RecursionError) as error:  # no such date, too many digits
        place_text, reason = "", error
    raise StarnavError(f"{place}{place_text}: {said_by(ValueError(reason))}; allowed: valid YAML")


def _count_values(node: yaml.Node, counts: dict[int, float]) -> float:
    """Return the number of values below a node, aliases written out; `counts` holds those of nodes already counted.

    Raises:
        ComposerError: there are more than `MOST_VALUES`, without end in a node that holds itself.
    """
    if id(node) not in counts:
        counts[id(node)] = math.inf  # until it is known: whoever meets it below itself
        child_nodes = node.value if isinstance(node, yaml.CollectionNode) else ()
        if isinstance(node, yaml.MappingNode):
            child_nodes = [part for pair in child_nodes for part in pair]
        counts[id(node)] = 1 + sum(_count_values(part, counts) for part in child_nodes)
    if counts[id(node)] > MOST_VALUES:
        raise yaml.composer.ComposerError(
            None, None, f"its aliases stand for more than {MOST_VALUES} values", node.start_mark
        )
    return counts[id(node)]


class Tagged(dict):
    """A mapping of a YAML file with the tag it carried."""

    tag: str = ""


class Loader(PlainLoader):
    """Plain YAML whose mappings may carry a tag and have each key once; it never makes objects of other kinds."""

    def construct_mapping(self, node: yaml.MappingNode, deep: bool = False) -> dict[Any, Any]:
        """A mapping, or an error that names the place of a key that is there twice."""
        seen_keys = set()
        for key, _ in node.value:
            if isinstance(key, yaml.ScalarNode) and key.tag != "tag:yaml.org,2002:merge":
                if key.value in seen_keys:
                    raise yaml.constructor.ConstructorError(None, None, f"key {key.value} is repeated", key.start_mark)
                seen_keys.add(key.value)
        return super().construct_mapping(node, deep)


def _read_tagged(loader: Loader, suffix: str, node: yaml.Node) -> Tagged:
    if isinstance(node, yaml.ScalarNode) and node.value == "":
        mapping = Tagged()
    elif isinstance(node, yaml.MappingNode):
        mapping = Tagged(loader.construct_mapping(node, deep=True))
    else:
        raise yaml.constructor.ConstructorError(None, None, f"!{suffix} must be followed by a mapping", node.start_mark)
    mapping.tag = suffix
    return mapping


class SectionDumper(yaml.SafeDumper):
    """Writes a section in one line, with its tag; one with a text of several lines as a block, line by line."""


def _write_section(dumper: SectionDumper, mapping: Tagged) -> yaml.Node:
    tag = f"!{mapping.tag}" if mapping.tag else "tag:yaml.org,2002:map"
    is_block = any(isinstance(value, str) and "\n" in value for value in mapping.values())
    return dumper.represent_mapping(tag, dict(mapping), flow_style=not is_block)


def _write_text(dumper: SectionDumper, text: str) -> yaml.Node:
    style = '"' if set(OTHER_BREAKS) & set(text) else "|" if "\n" in text else None
    return dumper.represent_scalar("tag:yaml.org,2002:str", text, style=style)


SectionDumper.add_representer(Tagged, _write_section)
SectionDumper.add_representer(str, _write_text)
Loader.add_multi_constructor("!", _read_tagged)


def format_section(values: dict[str, Any], tag: str = "") -> Tagged:
    """A mapping that is written in one line where it holds no text of several, and may carry a tag."""
    tagged_values = Tagged(values)
    tagged_values.tag = tag
    return tagged_values


def read_mapping(text: str, place: str, keys: Iterable[str]) -> dict[str, Any]:
    """The mapping that a YAML text holds; `keys` are named where it holds something else."""
    mapping = load_yaml(text, place, Loader)
    if not isinstance(mapping, dict):
        content_text = "is empty" if mapping is None else f"holds {shown(mapping)}"
        raise StarnavError(f"{place} {content_text}; allowed: a mapping with {', '.join(keys)}")
    return mapping
