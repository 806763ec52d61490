"""The pose of one frame in another, by the transforms that lead there."""

from types import SimpleNamespace

import numpy as np

from drake_starnav.lidar.transforms import Frames, pose_along

HALF = np.sqrt(0.5)
UPRIGHT, TURNED, UPSIDE_DOWN = (0.0, 0.0, 0.0, 1.0), (0.0, 0.0, HALF, HALF), (1.0, 0.0, 0.0, 0.0)


def add(frames: Frames, parent: str, child: str, place, rotation=UPRIGHT) -> None:
    header = SimpleNamespace(frame_id=parent, stamp=SimpleNamespace(sec=0, nanosec=0))
    p, q = (SimpleNamespace(**dict(zip("xyzw", values, strict=False))) for values in (place, rotation))
    frames.add(child, header, SimpleNamespace(translation=p, rotation=q), moves=False)


def test_frames_are_joined_by_a_common_one() -> None:
    frames = Frames("/tf_static")
    add(frames, "base_footprint", "/base_link", (0.0, 0.0, 0.1), TURNED)
    add(frames, "/base_footprint", "plate", (0.2, 0.1, 0.3))
    add(frames, "plate", "laser", (0.0, 0.0, 0.2), UPSIDE_DOWN)
    X = pose_along(frames.ways("laser")["base_link"], 0.0)
    np.testing.assert_allclose(X[:3, 3], [0.1, -0.2, 0.4], atol=1e-12)
    np.testing.assert_allclose(X[:3, :3], [[0.0, -1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, -1.0]], atol=1e-12)
    assert "camera" not in frames.ways("laser")
