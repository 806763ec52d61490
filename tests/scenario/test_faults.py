"""Faults that are declared: what they are by default, and what is refused."""

import pytest

from drake_starnav.errors import StarnavError
from drake_starnav.scenario.faults import DriveParameters, LocalizationParameters


def test_by_default_nothing_is_declared() -> None:
    assert LocalizationParameters().exact
    assert (DriveParameters().delay, DriveParameters().slip) == (0.0, 0.0)


@pytest.mark.parametrize("fault", [{"drift": 0.01}, {"jump": 0.1}])
def test_a_pose_that_errs_is_not_exact(fault: dict[str, float]) -> None:
    assert not LocalizationParameters(**fault).exact


@pytest.mark.parametrize(
    ("kind", "fault", "place"),
    [
        (LocalizationParameters, {"drift": -0.1}, "localization.drift"),
        (LocalizationParameters, {"jump_interval": 0.0}, "localization.jump_interval"),
        (DriveParameters, {"delay": 2.0}, "drive.delay"),
        (DriveParameters, {"slip": float("nan")}, "drive.slip"),
    ],
)
def test_what_no_robot_does_is_refused_by_name(kind: type, fault: dict[str, float], place: str) -> None:
    with pytest.raises(StarnavError, match=place):
        kind(**fault)
