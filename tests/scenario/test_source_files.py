"""All files that a world or a robot is made from are known, however deep: none is edited or written unnoticed."""

from pathlib import Path

import pytest

from drake_starnav.cli.simulate import simulate
from drake_starnav.scenario.scenario_file import load_scenario
from drake_starnav.scenario.source_files import source_files

MODEL = "world: !Model {directives: %s, goal: [4, 0]}\n"
MESH = "<collision><geometry><mesh><uri>{}</uri></mesh></geometry></collision>"
LINK = '<model name="{0}"><link name="l">{1}</link></model>'
CHAINS: dict[str, dict[str, str]] = {
    "directives": {
        "scenario.yaml": MODEL % "w.dmd.yaml",
        "w.dmd.yaml": "directives:\n- add_model: {name: a, file: 'file://{folder}/a/thing.sdf'}\n"
        "- add_directives: {file: package://mine/more.dmd.yaml}\n",
        "mine/more.dmd.yaml": "directives:\n- add_model: {name: b, file: package://mine/b.urdf}\n",
        "mine/b.urdf": '<robot name="b"><drake:x/><link name="l"><visual><geometry>'
        '<mesh filename="package://mine/meshes/b.obj"/></geometry></visual></link></robot>',
        "mine/meshes/b.obj": "v 0 0 0\n",
        "a/thing.sdf": f"<sdf><world name='w'>{LINK.format('box', MESH.format('my box.obj'))}"
        "<include><uri>model://part</uri></include></world></sdf>",
        "a/my box.obj": "v 0 0 0\n",
        "part/model.config": "<model><sdf version='1.7'>part.sdf</sdf></model>",
        "part/part.sdf": f"<sdf>{LINK.format('deep', MESH.format('<![CDATA[deep.gltf]]>'))}</sdf>",
        "part/deep.gltf": "{}",
    },
    "gazebo": {
        "scenario.yaml": MODEL % "worlds/w.world",
        "worlds/w.world": "<sdf><world name='w'><include><uri>model://crate</uri></include></world></sdf>",
        "models/crate/model.sdf": f"<sdf>{LINK.format('crate', MESH.format('c.stl'))}</sdf>",
        "models/crate/c.stl": "solid c\nfacet\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendfacet\nendsolid c\n",
    },
    "text": {
        "scenario.yaml": "world: !Model {goal: [4, 0]}\ndirectives:\n- add_model: {name: a, file: 'file://{folder}/a.sdf'}\n",
        "a.sdf": f"<sdf>{LINK.format('a', '')}</sdf>",
    },
    "map": {
        "scenario.yaml": "world: !RosMap {file: maps/m.yaml}\n",
        "maps/m.yaml": "image: images/m.pgm\nresolution: 0.05\norigin: [0, 0, 0]\nfree_thresh: 0.2\n"
        "occupied_thresh: 0.6\n",
        "maps/images/m.pgm": "P5",
    },
    "robot": {
        "scenario.yaml": "world: !Room {}\nrobot: {model: own/robot.urdf, radius: 0.3}\n",
        "own/robot.urdf": '<robot name="r"><link name="l"><collision><geometry><mesh filename="hull.obj"/></geometry>'
        "</collision></link></robot>",
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


@pytest.mark.parametrize(("chain", "name"), [(c, n) for c in CHAINS for n in CHAINS[c]])
def test_no_command_writes_over_any_of_them(chain: str, name: str, tmp_path: Path, capsys) -> None:
    scenario = write(tmp_path, CHAINS[chain])
    before = (tmp_path / name).read_bytes()
    assert simulate([scenario, "--json", str(tmp_path / name)]) == 2
    assert "is to be read and written" in capsys.readouterr().err
    assert (tmp_path / name).read_bytes() == before
