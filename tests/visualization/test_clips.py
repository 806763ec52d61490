"""Clips hold the pictures they were given, in order, for as long as they should."""

import subprocess

import numpy as np
import pytest
from PIL import Image, ImageSequence

from drake_starnav.visualization.clips import (
    FINAL_PAUSE,
    picture_times,
    write_gif,
    write_mp4,
)

RATE = 10


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
    times = picture_times(2.05, rate=10, speed=2.0)
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


def test_a_gif_keeps_the_colours_of_small_things(tmp_path) -> None:
    shades = np.linspace(150, 255, 640).astype(np.uint8)
    image = np.dstack([np.tile(shades, (480, 1))] * 3)  # many greys, as along smooth edges
    image[..., 2] = 255
    image[100:106, 50:56] = (0, 118, 79)
    image[300:306, 90:96] = (159, 25, 118)
    write_gif(tmp_path / "x.gif", [Image.fromarray(image)], RATE)
    with Image.open(tmp_path / "x.gif") as clip:
        shown = np.asarray(clip.convert("RGB"), dtype=int)
    for row, column in ((103, 53), (303, 93)):
        assert np.abs(shown[row, column] - image[row, column]).max() < 12
    assert np.abs(shown - image).mean() < 4.0


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
