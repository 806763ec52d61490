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
