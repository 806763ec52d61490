"""Paths of the shipped robots and scenarios, in the installed package or in the checkout."""

from pathlib import Path

from drake_starnav.errors import StarnavError

_PACKAGE = Path(__file__).resolve().parents[1]
_FOLDERS = (_PACKAGE / "share", _PACKAGE.parent / "models")
"""Folders of an installed wheel and of a checkout; the build copies the second to the first."""

PACKAGE_URI = "package://drake_starnav/"
"""Of the models folder, as Drake's `Parser` writes it."""


def find_model_path(*parts: str) -> Path:
    """The absolute path of a shipped file or folder below the models folder, which need not exist.

    Without parts, the folder itself, whose `package.xml` makes `package://drake_starnav/...` known to Drake's `Parser`.

    Raises:
        StarnavError: the package was copied without its models.
    """
    for folder in _FOLDERS:
        if (folder / "package.xml").is_file():
            return folder.joinpath(*parts)
    places = " or ".join(str(folder) for folder in _FOLDERS)
    raise StarnavError(f"models: no package.xml in {places}; allowed: an installed wheel or a checkout with its models")


def resolve_path(name: str) -> Path:
    """The path that a parameter names: a shipped file as `package://drake_starnav/maps/...`, or any other path.

    Raises:
        StarnavError: the URI is of another package.
    """
    if not name.startswith("package://"):
        return Path(name)
    if not name.startswith(PACKAGE_URI):
        raise StarnavError(f"path {name}: allowed: a path, or {PACKAGE_URI} and a shipped file")
    return find_model_path(*name.removeprefix(PACKAGE_URI).split("/"))
