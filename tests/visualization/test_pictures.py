"""Stills and clips by `Recorder.save`, in the format that their names ask for."""

import pytest
from PIL import Image

from drake_starnav.loading import parse_scenario
from drake_starnav.simulation.run import run_trial
from drake_starnav.visualization.recorder import Recorder

TEXT = "world: !Obstacles {bounds: [-1, -2, 5, 2], cylinders: [[1.5, 0.1, 0.3]], goal: [3.5, 0.0]}\n"


@pytest.fixture(scope="module")
def recorder(tmp_path_factory):
    recorder = Recorder(tmp_path_factory.mktemp("recorded") / "post.html")
    run_trial(parse_scenario(TEXT + "simulation: {timeout: 1.5}\n", name="post"), observer=recorder)
    return recorder


@pytest.mark.parametrize(
    ("suffix", "begin"), [(".png", b"\x89PNG"), (".svg", b"<?xml"), (".pdf", b"%PDF"), (".gif", b"GIF89a")]
)
def test_the_name_says_the_format(recorder, suffix: str, begin: bytes, tmp_path) -> None:
    recorder.save(tmp_path / f"a{suffix}", time=0.5, width=300, rate=2)
    assert (tmp_path / f"a{suffix}").read_bytes().startswith(begin)


def test_a_clip_shows_the_run_and_a_still_its_end(recorder, tmp_path) -> None:
    recorder.save(tmp_path / "a.gif", width=300, rate=4, speed=1.0)
    with Image.open(tmp_path / "a.gif") as clip:
        assert clip.n_frames == 7 and clip.width == 300
    recorder.save(tmp_path / "end.png")
    recorder.save(tmp_path / "late.png", time=99.0)
    assert (tmp_path / "end.png").read_bytes() == (tmp_path / "late.png").read_bytes()
