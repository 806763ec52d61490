"""Stills and clips of a recorded run as files, whose names say the format by their ends."""

from collections.abc import Sequence
from pathlib import Path

from drake_starnav.errors import StarnavError
from drake_starnav.utils.progress import Progress
from drake_starnav.visualization.clips import picture_times, write_gif, write_mp4, write_png
from drake_starnav.visualization.plot import moment_picture, write_figure
from drake_starnav.visualization.timeline import RecordedRun

STILLS, CLIPS = (".png", ".svg", ".pdf"), (".gif", ".mp4")


def write_still(path: Path, recorded: RecordedRun, time: float, view: str = "top", width: int = 1100) -> None:
    """Write a moment of a run, at a time, s, as one of `STILLS`; view and width, pixels, are of a PNG file's."""
    at = min(time, recorded.duration)
    if path.suffix == ".png":
        write_png(path, moment_picture(recorded, at, view, width))
    else:
        write_figure(path, recorded, at)


def write_clips(
    paths: Sequence[Path],
    recorded: RecordedRun,
    view: str = "top",
    width: int = 1100,
    speed: float = 2.0,
    rate: int = 10,
) -> None:
    """Write a run as each of `CLIPS` that are asked for: `rate` pictures a second, `speed` times real time."""
    times, pictures = picture_times(recorded.duration, rate, speed), []
    with Progress("pictures") as bar:
        for time in times:
            pictures.append(moment_picture(recorded, float(time), view, width))
            bar.count(len(pictures), len(times))
    for path in paths:
        with Progress(path.suffix[1:]) as bar:
            if path.suffix == ".gif":
                said = ", ".join((recorded.caption.heading, *recorded.caption.lines)).replace("\u00a0", " ")
                write_gif(path, pictures, rate, said, bar.count)
            else:
                write_mp4(path, pictures, rate, bar.count)


def check_suffix(path: Path) -> None:
    """Raise a `StarnavError` for a file of another format."""
    if path.suffix not in STILLS + CLIPS:
        raise StarnavError(f"picture {path}; allowed: a name that ends in {', '.join(STILLS + CLIPS)}")
