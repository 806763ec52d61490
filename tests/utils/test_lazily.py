"""Names are imported when they are first used."""

import subprocess
import sys

import pytest

import drake_starnav
from drake_starnav import runtime


@pytest.mark.parametrize("package", [drake_starnav, runtime])
def test_a_name_that_is_not_public_is_an_attribute_error(package) -> None:
    with pytest.raises(AttributeError, match=f"module '{package.__name__}' has no attribute 'Robots'"):
        _ = package.Robots


def test_the_names_are_listed() -> None:
    assert dir(drake_starnav) == sorted(drake_starnav.__all__)


def test_the_list_of_names_imports_nothing() -> None:
    code = "import sys, drake_starnav.runtime as it; assert 'drive' in it.__all__; assert 'numpy' not in sys.modules"
    subprocess.run([sys.executable, "-c", code], check=True)
