"""Stills and clips: a sequence of pictures as PNG, GIF or MP4."""

import contextlib
import shutil
import subprocess
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path

import numpy as np
from PIL import Image

from drake_starnav.errors import StarnavError
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
    size = f"{pictures[0].width}x{pictures[0].height}"
    with replacing(path) as temporary:
        command = [find_ffmpeg(), "-y", "-loglevel", "error", "-f", "rawvideo", "-pix_fmt", "rgb24", "-s", size]
        command += ["-r", str(rate), "-i", "-", "-vf", "crop=trunc(iw/2)*2:trunc(ih/2)*2", "-c:v", "libx264"]
        command += ["-pix_fmt", "yuv420p", "-crf", "20", "-movflags", "+faststart", "-f", "mp4", str(temporary)]
        # in a session of its own it does not hear Ctrl-C, and ends with this process
        encoder = subprocess.Popen(command, stdin=subprocess.PIPE, stderr=subprocess.PIPE, start_new_session=True)
        assert encoder.stdin is not None and encoder.stderr is not None
        try:
            with contextlib.suppress(BrokenPipeError):  # ffmpeg reports the reason itself
                for picture in _reported(pictures, progress):
                    encoder.stdin.write(picture.tobytes())
                for _ in range(round(FINAL_PAUSE * rate) - 1):
                    encoder.stdin.write(pictures[-1].tobytes())
            complaint = encoder.communicate()[1].decode(errors="replace").strip()
        finally:
            if encoder.poll() is None:
                encoder.kill()
                encoder.wait()
        if encoder.returncode != 0:
            raise StarnavError(f"ffmpeg failed on {path}: {complaint.splitlines()[-1] if complaint else 'no reason'}")


def _reported(pictures: Sequence[Image.Image], progress: Progress | None) -> Iterator[Image.Image]:
    """The pictures in order; each is done when the next one is asked for."""
    for done, picture in enumerate(pictures, start=1):
        yield picture
        if progress is not None:
            progress(done, len(pictures))


def find_ffmpeg() -> str:
    """The program, from PATH or from the package imageio-ffmpeg; a `StarnavError` if neither is installed."""
    found = shutil.which("ffmpeg")
    if found is None:
        try:
            import imageio_ffmpeg  # an extra

            found = imageio_ffmpeg.get_ffmpeg_exe()
        except (ImportError, RuntimeError):
            raise StarnavError(
                "an MP4 needs ffmpeg, which is not on PATH; allowed: install it or imageio-ffmpeg, or write a GIF"
            ) from None
    return str(found)
