"""Stills and clips: a sequence of pictures as PNG, GIF or MP4."""

from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image

from drake_starnav.errors import StarnavError, said_by
from drake_starnav.utils.files import replacing

GIF_COLORS, PALETTE_PICTURES, KMEANS = 128, 5, 3
"""Of the palette that all pictures of a GIF share, so that none shimmers: its size, the pictures it is made from, and
Pillow's threshold for refining it."""
FINAL_PAUSE = 1.5
"""Duration of the last picture, s."""


def picture_times(duration: float, rate: int, speed: float) -> np.ndarray:
    """Times of a clip's pictures, shape (n,), s of the run; the first at its start, the last at its end.

    A clip has `rate` pictures a second, and shows `speed` seconds of the run of this duration, s, in one of its own.
    """
    times = np.arange(0.0, duration, speed / rate)
    return np.append(times, duration)


def write_png(path: Path, picture: Image.Image) -> None:
    """Write a still."""
    with replacing(path) as temporary:
        picture.save(temporary, format="PNG", optimize=True)


Progress = Callable[[int, int], None]
"""Called after each picture with the number done and the number of all."""


def write_gif(
    path: Path, pictures: Sequence[Image.Image], rate: int, caption: str = "", progress: Progress | None = None
) -> None:
    """Write pictures of equal size, `rate` a second (in hundredths of seconds), as a repeating GIF with a comment."""
    chosen = [pictures[round(at)] for at in np.linspace(0, len(pictures) - 1, PALETTE_PICTURES)]
    sample = Image.fromarray(np.vstack([np.asarray(picture) for picture in chosen]))
    # The widest coverage keeps the colours of small things; k-means then makes those of large areas exact.
    palette = sample.quantize(GIF_COLORS, Image.Quantize.MAXCOVERAGE, kmeans=KMEANS, dither=Image.Dither.NONE)
    frames = (picture.quantize(palette=palette, dither=Image.Dither.NONE) for picture in _reported(pictures, progress))
    durations = [round(100.0 / rate) * 10] * (len(pictures) - 1) + [round(1000.0 * FINAL_PAUSE)]
    with replacing(path) as temporary:
        next(frames).save(
            temporary, format="GIF", save_all=True, append_images=frames, duration=durations, loop=0, optimize=True,
            comment=caption.encode("utf-8"),
        )  # fmt: skip


def write_mp4(path: Path, pictures: Sequence[Image.Image], rate: int, progress: Progress | None = None) -> None:
    """Write pictures of equal size, `rate` a second, as H.264 that all common players support.

    Raises:
        StarnavError: there is no ffmpeg, or it fails.
    """
    even = "crop=trunc(iw/2)*2:trunc(ih/2)*2"
    more = ["-vf", even, "-crf", "20", "-movflags", "+faststart", "-f", "mp4"]
    look: dict[str, Any] = {"fps": rate, "codec": "libx264", "quality": None, "macro_block_size": 1}
    with replacing(path) as temporary:
        try:
            encoder = ffmpeg().write_frames(str(temporary), pictures[0].size, output_params=more, **look)
            encoder.send(None)
            for picture in _reported(pictures, progress):
                encoder.send(picture.tobytes())
            for _ in range(round(FINAL_PAUSE * rate) - 1):
                encoder.send(pictures[-1].tobytes())
            encoder.close()
        except OSError as error:
            raise StarnavError(f"ffmpeg failed on {path}: {said_by(error)}; allowed: a clip that it encodes") from None


def _reported(pictures: Sequence[Image.Image], progress: Progress | None) -> Iterator[Image.Image]:
    """The pictures in order; each is done when the next one is asked for."""
    for done, picture in enumerate(pictures, start=1):
        yield picture
        if progress is not None:
            progress(done, len(pictures))


def ffmpeg() -> Any:
    """The package that encodes MP4; a `StarnavError` if it is not installed."""
    try:
        import imageio_ffmpeg
    except ImportError:
        raise StarnavError(
            "an MP4 needs imageio-ffmpeg; allowed: pip install 'drake-starnav[video]', or a GIF"
        ) from None
    return imageio_ffmpeg
