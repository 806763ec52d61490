"""Stills and clips of a recorded run as files, whose names say the format by their ends."""

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image

from drake_starnav.errors import StarnavError, said_by
from drake_starnav.utils.files import replace_file
from drake_starnav.utils.progress import Progress
from drake_starnav.visualization.plot import draw_moment, write_figure
from drake_starnav.visualization.timeline import RecordedRun
from drake_starnav.visualization.world_figure import WIDTH

PIXELS = 1100
"""Width of pictures unless another one is given."""
STILLS, CLIPS = (".png", ".svg", ".pdf"), (".gif", ".mp4")
FINAL_PAUSE = 1.5
"""Duration of the last picture, s."""


def write_still(path: Path, run: RecordedRun, time: float, view: str, width: float | None) -> None:
    """Write a moment of a run, at a time, s, as one of `STILLS`; for the rest see `Recorder.save`."""
    at = min(time, run.duration)
    if path.suffix == ".png":
        with replace_file(path) as temporary:
            draw_moment(run, at, view, round(width or PIXELS)).save(temporary, format="PNG", optimize=True)
    else:
        write_figure(path, run, at, WIDTH if width is None else width)


def write_clips(paths: Sequence[Path], run: RecordedRun, view: str, width: int, speed: float, rate: int) -> None:
    """Write a run as each of `CLIPS` that are asked for: `rate` pictures a second, `speed` times real time."""
    picture_times, pictures = choose_picture_times(run.duration, rate, speed), []
    with Progress("pictures") as bar:
        for time in picture_times:
            pictures.append(draw_moment(run, float(time), view, width))
            bar.count(len(pictures), len(picture_times))
    for path in paths:
        if path.suffix == ".gif":
            caption_text = ", ".join((run.caption.heading, *run.caption.lines)).replace("\u00a0", " ")
            write_gif(path, pictures, rate, caption_text)
        else:
            write_mp4(path, pictures, rate)


def choose_picture_times(duration: float, rate: int, speed: float) -> np.ndarray:
    """Times of a clip's pictures, shape (n,), s of the run; the first at its start, the last at its end.

    A clip has `rate` pictures a second, and shows `speed` seconds of the run of this duration, s, in one of its own.
    """
    times = np.arange(0.0, duration, speed / rate)
    return np.append(times, duration)


def write_gif(path: Path, pictures: Sequence[Image.Image], rate: int, caption: str) -> None:
    """Write pictures of equal size, `rate` a second (in hundredths of seconds), as a repeating GIF with a comment."""
    sample_pictures = [pictures[round(at)] for at in np.linspace(0, len(pictures) - 1, 5)]
    sample_image = Image.fromarray(np.vstack([np.asarray(picture) for picture in sample_pictures]))
    # All pictures share a palette, or they would shimmer. The widest coverage keeps the colours of small things, and
    # k-means makes those of large areas exact.
    palette = sample_image.quantize(128, Image.Quantize.MAXCOVERAGE, kmeans=3, dither=Image.Dither.NONE)
    durations = [round(100.0 / rate) * 10] * (len(pictures) - 1) + [round(1000.0 * FINAL_PAUSE)]
    with replace_file(path) as temporary, Progress("gif") as bar:
        frames = (each.quantize(palette=palette, dither=Image.Dither.NONE) for each in _report_each(pictures, bar))
        next(frames).save(
            temporary, format="GIF", save_all=True, append_images=frames, duration=durations, loop=0, optimize=True,
            comment=caption.encode("utf-8"),
        )  # fmt: skip


def write_mp4(path: Path, pictures: Sequence[Image.Image], rate: int) -> None:
    """Write pictures of equal size, `rate` a second, as H.264 that all common players support.

    Raises:
        StarnavError: there is no ffmpeg, or it fails.
    """
    even_crop = "crop=trunc(iw/2)*2:trunc(ih/2)*2"
    more = ["-vf", even_crop, "-crf", "20", "-movflags", "+faststart", "-f", "mp4"]
    video_format: dict[str, Any] = {"fps": rate, "codec": "libx264", "quality": None, "macro_block_size": 1}
    with replace_file(path) as temporary, Progress("mp4") as bar:
        try:
            encoder = import_ffmpeg().write_frames(str(temporary), pictures[0].size, output_params=more, **video_format)
            encoder.send(None)
            for picture in _report_each(pictures, bar):
                encoder.send(picture.tobytes())
            for _ in range(round(FINAL_PAUSE * rate) - 1):
                encoder.send(pictures[-1].tobytes())
            encoder.close()
        except OSError as error:
            raise StarnavError(f"ffmpeg failed on {path}: {said_by(error)}; allowed: a clip that it encodes") from None


def _report_each(pictures: Sequence[Image.Image], bar: Progress) -> Iterator[Image.Image]:
    """The pictures in order; each is done when the next one is asked for."""
    for done, picture in enumerate(pictures, start=1):
        yield picture
        bar.count(done, len(pictures))


def import_ffmpeg() -> Any:
    """The package that encodes MP4; a `StarnavError` if it is not installed."""
    try:
        import imageio_ffmpeg
    except ImportError:
        raise StarnavError(
            "an MP4 needs imageio-ffmpeg; allowed: pip install 'drake-starnav[video]', or a GIF"
        ) from None
    return imageio_ffmpeg
