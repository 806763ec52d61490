"""Stills and clips have the format of their names; clips hold their pictures, in order, for as long as they should."""

import subprocess

import numpy as np
import pytest
from PIL import Image, ImageSequence

from drake_starnav import Recorder, parse_scenario, run_trial
from drake_starnav.visualization.pictures import FINAL_PAUSE, choose_picture_times, write_gif, write_mp4

RATE = 10
TEXT = "world: !Obstacles {bounds: [-1, -2, 5, 2], cylinders: [[1.5, 0.1, 0.3]], goal: [3.5, 0.0]}\n"


def pictures(count: int = 6, size: tuple[int, int] = (121, 80)) -> list[Image.Image]:
    """A black square that moves to the right on white, beside a red rim."""
    made = []
    for k in range(count):
        image = np.full((size[1], size[0], 3), 255, np.uint8)
        image[30:50, 10 + 15 * k : 25 + 15 * k] = 0
        image[:, :4] = (200, 0, 0)
        made.append(Image.fromarray(image))
    return made


def middle(image: Image.Image) -> float:
    dark = np.asarray(image.convert("RGB"), dtype=float).max(axis=2) < 100
    return float(np.nonzero(dark)[1].mean())


def test_times_reach_from_start_to_end() -> None:
    times = choose_picture_times(2.05, rate=10, speed=2.0)
    assert times[0] == 0.0 and times[-1] == 2.05
    assert np.diff(times[:-1]) == pytest.approx(0.2)


def test_a_gif_shows_every_picture_and_repeats(tmp_path) -> None:
    write_gif(tmp_path / "x.gif", pictures(), RATE, "a caption")
    with Image.open(tmp_path / "x.gif") as clip:
        assert clip.info["comment"] == b"a caption"
        assert clip.info["loop"] == 0
        frames = [(frame.info["duration"], middle(frame)) for frame in ImageSequence.Iterator(clip)]
    assert [duration for duration, _ in frames] == [100.0] * 5 + [1000.0 * FINAL_PAUSE]
    assert [place for _, place in frames] == pytest.approx([17.0 + 15 * k for k in range(6)])


def test_an_mp4_shows_every_picture_and_then_stays(tmp_path) -> None:
    ffmpeg = pytest.importorskip("imageio_ffmpeg", reason="needs the extra video").get_ffmpeg_exe()
    write_mp4(tmp_path / "x.mp4", pictures(), RATE)
    raw = subprocess.run(
        [ffmpeg, "-loglevel", "error", "-i", tmp_path / "x.mp4", "-f", "rawvideo", "-pix_fmt", "rgb24", "-"],
        capture_output=True,
        check=True,
    ).stdout
    frames = np.frombuffer(raw, np.uint8).reshape(-1, 80, 120, 3)  # an odd width loses a column
    places = [middle(Image.fromarray(frame)) for frame in frames]
    assert places[:6] == pytest.approx([17.0 + 15 * k for k in range(6)], abs=0.6)
    assert len(places) == 5 + round(FINAL_PAUSE * RATE)
    assert [path.name for path in tmp_path.iterdir()] == ["x.mp4"]


@pytest.fixture(scope="module")
def recorder(tmp_path_factory):
    recorder = Recorder(tmp_path_factory.mktemp("recorded") / "post.html")
    run_trial(parse_scenario(TEXT + "simulation: {timeout: 1.5}\n", name="post"), observer=recorder)
    return recorder


@pytest.mark.parametrize(
    ("suffix", "begin"), [(".png", b"\x89PNG"), (".svg", b"<?xml"), (".pdf", b"%PDF"), (".gif", b"GIF89a")]
)
def test_the_name_says_the_format(recorder, suffix: str, begin: bytes, tmp_path) -> None:
    recorder.save(tmp_path / f"a{suffix}", time=0.5, width=3 if suffix in (".svg", ".pdf") else 300, rate=2)
    assert (tmp_path / f"a{suffix}").read_bytes().startswith(begin)


def test_a_clip_shows_the_run_and_a_still_its_end(recorder, tmp_path) -> None:
    recorder.save(tmp_path / "a.gif", width=300, rate=4, speed=1.0)
    with Image.open(tmp_path / "a.gif") as clip:
        assert clip.n_frames == 7 and clip.width == 300
    recorder.save(tmp_path / "end.png")
    recorder.save(tmp_path / "late.png", time=99.0)
    assert (tmp_path / "end.png").read_bytes() == (tmp_path / "late.png").read_bytes()
