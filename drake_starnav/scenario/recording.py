"""How a run is recorded and drawn, as declared in a scenario."""

from dataclasses import dataclass

from drake_starnav.parameters import parameter


@dataclass(frozen=True)
class RecordingParameters:
    """How a run is recorded and drawn."""

    frames_per_second: int = parameter(
        20, "frames of the animation; fewer make a smaller file", unit="1/s", low=1, high=120
    )
    scan_rate: float = parameter(
        5.0, "scans, paths and certificates that are drawn; fewer make a smaller file", unit="Hz", low=0.1, high=100.0
    )
    scan_points: int = parameter(
        180, "points of a scan that are drawn at most; fewer make a smaller file", low=3, high=10000
    )
    region_vertices: int = parameter(120, "corners of a region's outline; fewer make a smaller file", low=8, high=1440)
    line_width: float = parameter(
        0.07, "width of path and trail; edges are wider, outlines narrower by half", unit="m", low=0.001, high=1.0
    )
    node_radius: float = parameter(0.09, "radius of a roadmap node", unit="m", low=0.001, high=1.0)
    new_opacity: float = parameter(0.45, "of the newest region", low=0.0, high=1.0)
    old_opacity: float = parameter(0.12, "of a region as soon as a newer one is there", low=0.0, high=1.0)
    fade_time: float = parameter(3.0, "a region is gone this long after a newer one is there", unit="s", low=0.0)
