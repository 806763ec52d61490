"""What a URDF cannot say of a robot: its limits, in the YAML file beside it."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from drake_starnav.errors import StarnavError, shown
from drake_starnav.robot import MODEL_FILES
from drake_starnav.scenario.tagged_yaml import Loader
from drake_starnav.utils.files import read_text, reason_of
from drake_starnav.utils.resources import model_path
from drake_starnav.utils.yaml_text import LARGEST_TEXT, load_yaml

SAID = ("robot", "lidar")
"""Mappings that such a file may hold, beside the list `lidars`; all else, as in one of another program, is not read."""
EXCLUSIVE = ("radius", "footprint")
"""Who says one of these of a robot does not want the other from its model's file."""


def limits_file(model: str) -> Path | None:
    """The file `X.yaml` beside the `X.urdf` or `X.urdf.xacro` of `robot.model`, if there is one."""
    own = model.endswith(MODEL_FILES)
    path = Path(model) if own else model_path("robots", model)
    beside = path.with_name(f"{path.name.partition('.')[0] if own else path.name}.yaml")
    return beside if beside.is_file() else None


def of_model(model: str, sections: Mapping[str, Any]) -> dict[str, Any]:
    """The sections `robot`, `lidar` and `lidars` of a model's file, over which those of a scenario are to be laid.

    Without `model`, and without what the scenario's sections say otherwise; empty where there is no file.

    Raises:
        StarnavError: the file is no YAML file, or a section no mapping.
    """
    path = limits_file(model)
    if path is None:
        return {}
    try:
        text = read_text(path, LARGEST_TEXT)
    except OSError as error:
        raise StarnavError(f"{path} cannot be read: {reason_of(error)}; allowed: a UTF-8 YAML file") from None
    content = load_yaml(text, str(path), Loader)
    if not isinstance(content, dict):
        return {}
    found: dict[str, Any] = {"lidars": content["lidars"]} if "lidars" in content else {}
    for name in SAID:
        part, own = content.get(name) or {}, sections.get(name)
        if not isinstance(part, dict):
            raise StarnavError(f"{path}: {name} is {shown(part)}; allowed: a mapping, as in a scenario")
        unwanted = {"model"}
        if isinstance(own, dict) and any(key in own for key in EXCLUSIVE):
            unwanted |= set(EXCLUSIVE)
        found[name] = {key: value for key, value in part.items() if key not in unwanted}
    return found
