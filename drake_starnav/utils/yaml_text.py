"""YAML from untrusted sources: plain values only, whose total size is checked before they are constructed."""

import re
from typing import Any

import yaml

from drake_starnav.errors import StarnavError, said_by

LARGEST_TEXT = 16 * 2**20
"""Of a file, bytes."""
MOST_VALUES = 1_000_000
"""Values that a text may represent once its aliases are expanded."""
DEEPEST = 100
"""Greatest depth of nested lists and mappings."""

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
