"""How a run is recorded is declared as all else: within limits, by name."""

import pytest

from drake_starnav.errors import StarnavError
from drake_starnav.parameters import build
from drake_starnav.scenario.recording import RecordingParameters


def test_the_defaults_are_within_their_limits() -> None:
    assert build(RecordingParameters, {}, "recording") == RecordingParameters()


@pytest.mark.parametrize("key, value", [("frames_per_second", 0), ("scan_rate", 0.0)])
def test_others_are_refused_by_name(key: str, value: float) -> None:
    with pytest.raises(StarnavError, match=f"recording.{key}"):
        build(RecordingParameters, {key: value}, "recording")
