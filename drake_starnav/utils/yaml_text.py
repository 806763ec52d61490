"""YAML from untrusted sources: plain values and tagged mappings, as `world: !Forest {width: 20}`, of checked size."""

import re
from collections.abc import Iterable
from typing import Any

import yaml

from drake_starnav.errors import StarnavError, said_by, shown

LARGEST_TEXT = 16 * 2**20
"""Of a file, bytes."""
MOST_VALUES = 1_000_000
"""Values that a text may represent once its aliases are expanded."""
DEEPEST = 100
"""Greatest depth of nested lists and mappings."""
OTHER_BREAKS = "\x85\u2028\u2029"
"""Line breaks of YAML that are only kept where they are escaped."""


_Loader: type = getattr(yaml, "CSafeLoader", yaml.SafeLoader)  # the one in C is much faster


class PlainLoader(_Loader):
    """Makes numbers, texts, lists and mappings; of other tags only what a subclass adds."""


PlainLoader.add_implicit_resolver(  # as in YAML 1.2; 1.1 reads 1e-3 as a text
    "tag:yaml.org,2002:float", re.compile(r"[-+]?(\d[\d_]*\.?[\d_]*|\.\d[\d_]*)[eE][-+]?\d+$"), list("-+.0123456789")
)


def load_yaml(text: str, place: str, loader: type = PlainLoader) -> Any:
    """The content of a YAML text of one document, by `PlainLoader` or a subclass; `place` names it in messages.

    Raises:
        StarnavError: it is not valid YAML, or represents too many values: a few aliases of aliases may expand to
            billions.
    """
    try:
        _check_size(text)
        return yaml.load(text, Loader=loader)
    except yaml.YAMLError as error:
        mark = getattr(error, "problem_mark", None)
        where = f" line {mark.line + 1}, column {mark.column + 1}" if mark else ""
        reason = getattr(error, "problem", None) or error
    except (ValueError, RecursionError) as error:  # no such date, too many digits
        where, reason = "", error
    raise StarnavError(f"{place}{where}: {said_by(ValueError(reason))}; allowed: valid YAML")


def _check_size(text: str) -> None:
    """Raise a `YAMLError` unless the values that a text stands for are few enough, and none holds itself."""
    sizes: dict[str, int] = {}
    open_: list[tuple[str | None, int]] = []  # anchors of the collections around, and how many values stood before
    count = 0
    for event in yaml.parse(text, Loader=PlainLoader):
        if isinstance(event, yaml.CollectionStartEvent):
            open_.append((event.anchor, count))
            count += 1
            if len(open_) > DEEPEST:
                raise yaml.MarkedYAMLError(None, None, "it is nested too deeply", event.start_mark)
        elif isinstance(event, yaml.CollectionEndEvent):
            anchor, before = open_.pop()
            if anchor is not None:
                sizes[anchor] = count - before
        elif isinstance(event, yaml.AliasEvent):
            if any(anchor == event.anchor for anchor, _ in open_):
                raise yaml.MarkedYAMLError(None, None, f"{event.anchor} holds itself", event.start_mark)
            count += sizes.get(event.anchor, 1)
        elif isinstance(event, yaml.ScalarEvent):
            count += 1
            if event.anchor is not None:
                sizes[event.anchor] = 1
        if count > MOST_VALUES:
            raise yaml.MarkedYAMLError(None, None, f"it stands for more than {MOST_VALUES} values", event.start_mark)


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


class SectionDumper(yaml.SafeDumper):
    """Writes a section in one line, with its tag; one with a text of several lines as a block, line by line."""


def _written_section(dumper: SectionDumper, mapping: Tagged) -> yaml.Node:
    tag = f"!{mapping.tag}" if mapping.tag else "tag:yaml.org,2002:map"
    block = any(isinstance(value, str) and "\n" in value for value in mapping.values())
    return dumper.represent_mapping(tag, dict(mapping), flow_style=not block)


def _written_text(dumper: SectionDumper, text: str) -> yaml.Node:
    style = '"' if set(OTHER_BREAKS) & set(text) else "|" if "\n" in text else None
    return dumper.represent_scalar("tag:yaml.org,2002:str", text, style=style)


SectionDumper.add_representer(Tagged, _written_section)
SectionDumper.add_representer(str, _written_text)
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
