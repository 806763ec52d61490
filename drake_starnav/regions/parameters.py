"""Parameters of star-shaped regions: of the planner's region and of the controller's safety star."""

from dataclasses import dataclass

from drake_starnav.parameters import parameter


@dataclass(frozen=True)
class StarParameters:
    """How a scan becomes a star-shaped region of free robot positions."""

    margin: float = parameter(
        0.03,
        "clearance kept beyond the robot's radius",
        unit="m",
        low=0.0,
        high=1.0,
        when="raise it by one or two standard deviations of a noisy lidar",
    )
    least_margin: float = parameter(
        0.01,
        "clearance kept in passages that `planner.margin` would close; with `planner.margin` or more, none is entered",
        unit="m",
        low=0.0,
        high=1.0,
    )
    erosion: str = parameter(
        "disc",
        "how the robot's radius shrinks the scan: disc (exact configuration space), radial (range - radius), "
        "none (the paper: the scan itself bounds the star)",
        choices=("disc", "radial", "none"),
    )
    smoothing: str = parameter(
        "moving_average",
        "noise filter on the ranges: moving_average within connected runs, gaussian (the paper), or none",
        choices=("moving_average", "gaussian", "none"),
    )
    smoothing_beams: int = parameter(3, "half width of the moving average, in beams", low=0, high=50)
    smoothing_slack: float = parameter(
        0.0,
        "additional range step allowed within a surface, and additional change allowed by the moving average; declared "
        "noise raises it",
        unit="m",
        low=0.0,
        high=1.0,
    )
    range_clip: float = parameter(
        1000.0, "ranges beyond this count as no return (the paper: 2.0)", unit="m", above=0.0, high=1000.0
    )
    bearings: int = parameter(720, "samples of the boundary, rounded up to whole samples a beam", low=36, high=7200)
    segmentation: str = parameter(
        "adaptive",
        "where cubics begin: adaptive (bisection by error), slope (the paper: by the change of the boundary's "
        "direction), fixed (equal parts)",
        choices=("adaptive", "slope", "fixed"),
    )
    segments: int = parameter(16, "number of cubics when segmentation is fixed", low=1, high=360)
    fit_tolerance: float = parameter(
        0.03, "largest overshoot plus undershoot of an adaptive cubic", unit="m", above=0.0, high=1.0
    )
    slope_change: float = parameter(
        0.06283185307179587,
        "change of direction that begins a new cubic when segmentation is slope",
        unit="rad",
        above=0.0,
        high=3.2,
    )
    one_sided_fit: bool = parameter(True, "lower every cubic until it lies inside the measured free range")
    jump: float = parameter(
        0.12, "range step between neighbouring samples that separates surfaces", unit="m", above=0.0, high=10.0
    )


@dataclass(frozen=True)
class SafetyParameters:
    """How the last scans become the safety star, within which the certificate keeps the robot."""

    safety_margin: float = parameter(
        0.01,
        "clearance that the certificate keeps beyond the robot's radius",
        unit="m",
        low=0.0,
        high=1.0,
        when="raise it for a base that does not follow its commands well",
    )
    safety_range: float = parameter(
        1.2,
        "extent of the safety star",
        unit="m",
        above=0.0,
        high=20.0,
        when="raise it for a fast robot in open space, above v^2 / (2 a)",
    )
    scan_memory: int = parameter(
        5,
        "number of scans from which the safety star is made",
        low=1,
        high=100,
    )
    smoothed_beams: int = parameter(
        0,
        "half width, in beams, of a moving average over the ranges of the safety star, which reduces the error of the "
        "nearest hit; 0: none; declared noise raises it",
        low=0,
        high=10000,
    )
    average_scans: bool = parameter(
        False,
        "average ranges over the remembered scans instead of using the nearest hit of all; not with moving obstacles; "
        "declared noise of 4 cm or more sets it",
        when="for doors that leave the robot less than 4 cm on each side",
    )
