"""Version and Pythons of a release agree everywhere."""

import re
import shutil
import subprocess
import tomllib
from pathlib import Path
from xml.etree import ElementTree

import pytest
import yaml

import drake_starnav

ROOT = Path(__file__).resolve().parents[2]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
CITATION = yaml.safe_load((ROOT / "CITATION.cff").read_text(encoding="utf-8"))
SECTION = re.compile(r"^## (\d+\.\d+\.\d+) \((unreleased|\d{4}-\d{2}-\d{2})\)$")


def sections() -> list[tuple[str, str]]:
    """Versions of the changelog and their dates, newest first."""
    lines = (ROOT / "CHANGELOG.md").read_text(encoding="utf-8").splitlines()
    found = [SECTION.match(line) for line in lines if line.startswith("## ")]
    assert all(found), "a section is not `## 1.2.3 (unreleased)` or `## 1.2.3 (2026-01-31)`"
    return [match.groups() for match in found if match]


def test_every_place_names_the_same_version() -> None:
    version = PROJECT["version"]
    package = ElementTree.parse(ROOT / "models" / "package.xml").getroot()
    assert package.findtext("version") == version
    assert CITATION["version"] == version
    assert sections()[0][0] == version
    assert drake_starnav.__version__ == version


def test_a_tagged_commit_is_that_release() -> None:
    if shutil.which("git") is None or not (ROOT / ".git").exists():
        pytest.skip("not run from a checkout of git")
    tags = subprocess.run(
        ["git", "tag", "--points-at", "HEAD", "v*"], cwd=ROOT, capture_output=True, text=True, check=True
    ).stdout.split()
    assert set(tags) <= {f"v{PROJECT['version']}"}
    assert not tags or sections()[0][1] != "unreleased"


def test_every_place_names_the_same_pythons() -> None:
    named = [re.fullmatch(r"Programming Language :: Python :: (3\.\d+)", line) for line in PROJECT["classifiers"]]
    versions = [match[1] for match in named if match]
    assert PROJECT["requires-python"] == f">={versions[0]}"
    table = (ROOT / "BUILD.md").read_text(encoding="utf-8").partition("| Python | Drake ")[2].partition("\n\n")[0]
    assert re.findall(r"^\| (3\.\d+) \|", table, re.MULTILINE) == versions
    workflow = ROOT / ".github" / "workflows" / "ci.yml"
    if workflow.is_file():
        jobs = yaml.safe_load(workflow.read_text(encoding="utf-8"))["jobs"]
        assert jobs["run"]["strategy"]["matrix"]["python"] == versions
