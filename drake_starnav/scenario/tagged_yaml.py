"""YAML with tags: `world: !Forest {width: 20}`."""

from collections.abc import Iterable
from typing import Any

import yaml

from drake_starnav.errors import StarnavError, shown
from drake_starnav.utils.yaml_text import PlainLoader, load_yaml

OTHER_BREAKS = "\x85\u2028\u2029"
"""Line breaks of YAML that are only kept where they are escaped."""


class Tagged(dict):
    """A mapping of a YAML file with the tag it carried."""

    tag: str = ""


class Loader(PlainLoader):
    """Plain YAML whose mappings may carry a tag and have each key once; it never makes objects of other kinds."""

    def construct_mapping(self, node: yaml.MappingNode, deep: bool = False) -> dict[Any, Any]:
        """A mapping, or an error that names the place of a key that is there twice."""
        seen = set()
        for key, _ in node.value:
            if isinstance(key, yaml.ScalarNode) and key.tag != "tag:yaml.org,2002:merge":
                if key.value in seen:
                    raise yaml.constructor.ConstructorError(None, None, f"key {key.value} is repeated", key.start_mark)
                seen.add(key.value)
        return super().construct_mapping(node, deep)


def _tagged(loader: Loader, suffix: str, node: yaml.Node) -> Tagged:
    if isinstance(node, yaml.ScalarNode) and node.value == "":
        mapping = Tagged()
    elif isinstance(node, yaml.MappingNode):
        mapping = Tagged(loader.construct_mapping(node, deep=True))
    else:
        raise yaml.constructor.ConstructorError(None, None, f"!{suffix} must be followed by a mapping", node.start_mark)
    mapping.tag = suffix
    return mapping


class TaggedDumper(yaml.SafeDumper):
    """Writes mappings with the tags that they were read with."""


class SectionDumper(yaml.SafeDumper):
    """Writes a section in one line, but one with a text of several lines as a block, and that text line by line."""


def _written_section(dumper: SectionDumper, mapping: Tagged) -> yaml.Node:
    tag = f"!{mapping.tag}" if mapping.tag else "tag:yaml.org,2002:map"
    block = any(isinstance(value, str) and "\n" in value for value in mapping.values())
    return dumper.represent_mapping(tag, dict(mapping), flow_style=not block)


def _written_text(dumper: SectionDumper, text: str) -> yaml.Node:
    style = '"' if set(OTHER_BREAKS) & set(text) else "|" if "\n" in text else None
    return dumper.represent_scalar("tag:yaml.org,2002:str", text, style=style)


SectionDumper.add_representer(Tagged, _written_section)
SectionDumper.add_representer(str, _written_text)
TaggedDumper.add_representer(Tagged, lambda dumper, value: dumper.represent_mapping(f"!{value.tag}", dict(value)))
Loader.add_multi_constructor("!", _tagged)


def section(values: dict[str, Any], tag: str = "") -> Tagged:
    """A mapping that is written in one line where it holds no text of several, and may carry a tag."""
    tagged = Tagged(values)
    tagged.tag = tag
    return tagged


def read_mapping(text: str, place: str, keys: Iterable[str]) -> dict[str, Any]:
    """The mapping that a YAML text holds; `keys` are named where it holds something else."""
    mapping = load_yaml(text, place, Loader)
    if not isinstance(mapping, dict):
        raise StarnavError(f"{place} holds {shown(mapping)}; allowed: a mapping with {', '.join(keys)}")
    return mapping
