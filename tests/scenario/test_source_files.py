"""All files that a world or a robot is made from are known, however deep: none is edited or written unnoticed."""

import json
from pathlib import Path

import pytest

from drake_starnav.cli.main import simulate
from drake_starnav.errors import StarnavError
from drake_starnav.evaluation import TrialFile, make_cases, make_header
from drake_starnav.scenario import load_scenario
from drake_starnav.scenario.source_files import source_files

MODEL = "world: !Model {directives: %s, goal: [4, 0]}\n"
GLTF = {
    "asset": {"version": "2.0"},
    "buffers": [{"uri": "data%201.bin"}, {"uri": "data:,x"}],
    "images": [{"uri": "i.png"}],
}
CHAINS: dict[str, dict[str, str]] = {
    "directives": {
        "scenario.yaml": MODEL % "w.dmd.yaml",
        "w.dmd.yaml": "directives:\n- add_model: {name: a, file: 'file://{folder}/a/thing.sdf'}\n"
        "- add_directives: {file: package://mine/more.dmd.yaml}\n",
        "mine/more.dmd.yaml": "directives:\n- add_model: {name: b, file: package://mine/b.urdf}\n",
        "mine/b.urdf": "<robot><drake:x/><mesh filename='package://mine/meshes/b.obj'/></robot>",
        "mine/meshes/b.obj": "v 0 0 0\n",
        "a/thing.sdf": "<sdf><mesh><uri>my box.obj</uri></mesh><include><uri>model://part</uri></include></sdf>",
        "a/my box.obj": "mtllib box.mtl\nv 0 0 0\n",
        "a/box.mtl": "newmtl a\nmap_Kd -s 1 1 1 light wood.png\n",
        "a/light wood.png": "pixels",
        "part/model.config": "<model><sdf version='1.7'>part.sdf</sdf></model>",
        "part/part.sdf": "<sdf><uri><![CDATA[deep.gltf]]></uri></sdf>",
        "part/deep.gltf": json.dumps(GLTF),
        "part/data 1.bin": "bytes",
        "part/i.png": "pixels",
    },
    "mujoco": {
        "scenario.yaml": MODEL % "w.dmd.yaml",
        "w.dmd.yaml": "directives:\n- add_model: {name: a, file: 'file://{folder}/a.xml'}\n",
        "a.xml": '<mujoco><compiler meshdir="assets"/><include file="more.xml"/><mesh file="a.obj"/></mujoco>',
        "more.xml": "<mujoco/>",
        "assets/a.obj": "v 0 0 0\n",
    },
    "map": {
        "scenario.yaml": "world: !RosMap {file: maps/m.yaml}\n",
        "maps/m.yaml": "image: images/m.pgm\nresolution: 0.05\n",
        "maps/images/m.pgm": "P5",
    },
    "robot": {
        "scenario.yaml": "world: !Room {}\nrobot: {model: own/robot.urdf}\n",
        "own/robot.urdf": '<robot name="r"><link><visual><mesh filename="hull.obj"/></visual></link></robot>',
        "own/hull.obj": "v 0 0 0\n",
    },
    "worlds": {"scenario.yaml": "world: !Barn {file: w.json}\n", "w.json": '{"worlds": []}'},
}  # fmt: skip


def write(folder: Path, files: dict[str, str]) -> str:
    for name, text in files.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_text(text.replace("{folder}", str(folder)))
    return str(folder / "scenario.yaml")


@pytest.mark.parametrize("chain", CHAINS)
def test_every_file_of_a_chain_is_found(chain: str, tmp_path: Path) -> None:
    scenario = write(tmp_path, CHAINS[chain])
    (tmp_path / "stranger.obj").write_text("v 0 0 0\n")
    found = {path.relative_to(tmp_path).as_posix() for path in source_files(load_scenario(scenario))}
    assert found == set(CHAINS[chain]) - {"scenario.yaml"}


@pytest.mark.parametrize(("chain", "name"), [(c, n) for c in CHAINS for n in CHAINS[c] if n != "scenario.yaml"])
def test_resuming_notices_that_any_of_them_was_edited_or_removed(chain: str, name: str, tmp_path: Path) -> None:
    scenario, trials = write(tmp_path, CHAINS[chain]), tmp_path / "trials.jsonl"
    TrialFile(trials, make_header(make_cases([scenario], ["star"]), 0)).close()
    TrialFile(trials, make_header(make_cases([scenario], ["star"]), 0), resume=True).close()
    before = trials.read_bytes()
    for change in (lambda path: path.write_text(path.read_text() + " "), Path.unlink):
        change(tmp_path / name)
        with pytest.raises(StarnavError, match="written with other content of .*; allowed: --resume with the same"):
            TrialFile(trials, make_header(make_cases([scenario], ["star"]), 0), resume=True)
    assert trials.read_bytes() == before


@pytest.mark.parametrize(("chain", "name"), [(c, n) for c in CHAINS for n in CHAINS[c]])
def test_no_command_writes_over_any_of_them(chain: str, name: str, tmp_path: Path, capsys) -> None:
    scenario = write(tmp_path, CHAINS[chain])
    before = (tmp_path / name).read_bytes()
    assert simulate([scenario, "--json", str(tmp_path / name)]) == 2
    assert "is to be read and written" in capsys.readouterr().err
    assert (tmp_path / name).read_bytes() == before


def test_files_that_name_each_other_or_nothing_readable_end(tmp_path: Path) -> None:
    files = {
        "scenario.yaml": MODEL % "a.sdf",
        "a.sdf": "<sdf><uri>b.sdf</uri><uri>a.sdf</uri><uri>/</uri><uri>.</uri><uri>loop</uri><uri>package://no/x</uri></sdf>",
        "b.sdf": "<sdf><uri>a.sdf</uri><uri>file:///dev/zero</uri><uri>model://</uri></sdf>",
    }
    scenario = write(tmp_path, files)
    (tmp_path / "loop").symlink_to("loop")
    assert {path.name for path in source_files(load_scenario(scenario))} == {"a.sdf", "b.sdf"}
