"""Where the shipped robots and scenarios are: in the installed package, or in the checkout."""

from pathlib import Path

from drake_starnav.errors import StarnavError

_PACKAGE = Path(__file__).resolve().parent
_FOLDERS = (_PACKAGE / "share", _PACKAGE.parent / "models")
"""Of an installed wheel, and of a checkout; the build copies the second to the first."""


def model_path(*parts: str) -> Path:
    """The absolute path of a shipped file or folder, which need not exist.

    Args:
        parts: path below the models folder, e.g. "robots", "starbot.urdf"; none for the folder itself, whose
            `package.xml` makes `package://drake_starnav/...` known to Drake's `Parser`.

    Raises:
        StarnavError: the package was copied without its models.
    """
    for folder in _FOLDERS:
        if (folder / "package.xml").is_file():
            return folder.joinpath(*parts)
    places = " or ".join(str(folder) for folder in _FOLDERS)
    raise StarnavError(f"models: no package.xml in {places}; allowed: an installed wheel or a checkout with its models")
