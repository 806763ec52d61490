"""Maps as ROS's map_server reads them, and what is said of those that cannot be read."""

import math
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from drake_starnav.errors import StarnavError
from drake_starnav.worlds.formats.ros_map import FREE, OCCUPIED, UNKNOWN, OccupancyMap, read_map

KEYS = {"image": "m.pgm", "resolution": 0.1, "origin": [0.0, 0.0, 0.0], "occupied_thresh": 0.65, "free_thresh": 0.196}
CODES = {FREE: ".", OCCUPIED: "#", UNKNOWN: "?"}
PIXELS = np.array([[0, 254, 205], [254, 0, 254]], np.uint8)


def write(folder: Path, image: bytes | np.ndarray, name: str = "m.pgm", /, **changes) -> Path:
    """A map in a folder; a change to None leaves the key out."""
    if isinstance(image, bytes):
        (folder / name).write_bytes(image)
    else:
        Image.fromarray(image).save(folder / name)
    keys = {**KEYS, "image": name, **changes}
    path = folder / "m.yaml"
    path.write_text("".join(f"{key}: {value}\n" for key, value in keys.items() if value is not None))
    return path


def rows_of(path: Path) -> list[str]:
    """The map's cells as in the image, the upper row first."""
    return ["".join(CODES[cell] for cell in row) for row in read_map(path).cells[::-1]]


@pytest.mark.parametrize(
    ("changes", "rows"),
    [
        ({"resolution": "1e-1"}, ["#.?", ".#."]),
        ({"mode": "Trinary"}, ["#.?", ".#."]),
        ({"origin": "[0e0, -0e-3, 1E0]"}, ["#.?", ".#."]),
        ({"free_thresh": "1.96e-1", "occupied_thresh": "6.5E-1"}, ["#.?", ".#."]),
        ({"free_thresh": 0.5, "occupied_thresh": 0.5}, ["#..", ".#."]),
        ({"free_thresh": 0, "occupied_thresh": 0}, ["###", "###"]),
        ({"free_thresh": 1, "occupied_thresh": 1}, ["?..", ".?."]),
    ],
)
def test_keys_are_read_as_map_server_does(tmp_path: Path, changes: dict, rows: list[str]) -> None:
    assert rows_of(write(tmp_path, PIXELS, **changes)) == rows


def test_a_palette_and_a_bit_map_are_read(tmp_path: Path) -> None:
    path = write(tmp_path, PIXELS, "m.png")
    Image.fromarray(PIXELS).convert("P").save(tmp_path / "m.png")
    assert rows_of(path) == ["#.?", ".#."]
    Image.fromarray(np.array([[True, False]])).save(tmp_path / "m.png")
    assert rows_of(path) == [".#"]


@pytest.mark.parametrize(("negate", "row"), [(0, "#?..."), (1, ".?###")])
def test_dark_cells_are_occupied_and_bright_ones_in_a_negated_map(tmp_path: Path, negate: int, row: str) -> None:
    shades = np.array([[0, 128, 205, 230, 255]], np.uint8)
    assert rows_of(write(tmp_path, shades, negate=negate, free_thresh=0.25)) == [row]


def test_opacity_counts_as_a_fourth_colour(tmp_path: Path) -> None:
    pixels = np.array([[(s, s, s, a) for s, a in ((0, 255), (255, 255), (0, 0), (255, 128))]], np.uint8)
    assert rows_of(write(tmp_path, pixels, "m.png", free_thresh=0.25)) == ["#.#."]


@pytest.mark.parametrize("yaw", [0.0, 0.7, -2.5])
def test_places_follow_the_origin(yaw: float) -> None:
    grid = OccupancyMap(np.zeros((4, 6), np.int8), 0.5, (1.0, -2.0, yaw))
    center = grid.to_world(np.array([4.5, 1.5]))  # of cells[1, 4]
    cosine, sine = math.cos(yaw), math.sin(yaw)
    assert center == pytest.approx([1.0 + cosine * 2.25 - sine * 0.75, -2.0 + sine * 2.25 + cosine * 0.75])
    assert grid.find_cell((center[0], center[1])) == (1, 4)
    assert grid.find_cell((1.0 - cosine, -2.0 - sine)) is None


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"resolution": 0}, "resolution is 0; allowed: 0.001 <= x <= 100 m"),
        ({"resolution": 10**400}, r"resolution is 10+\.\.\.; allowed: a finite number"),
        ({"resolution": "fine"}, "resolution is 'fine'; allowed: a finite number"),
        ({"origin": [0, 0]}, r"origin is \[0, 0\]; allowed: finite \[x, y, yaw\]"),
        ({"origin": "[0, .nan, 0]"}, "origin"),
        ({"occupied_thresh": 0.1}, "free_thresh is 0.196, occupied_thresh is 0.1; allowed: 0 <= free_thresh <= occ"),
        ({"free_thresh": -0.1}, "free_thresh is -0.1"),
        ({"negate": 2}, "negate is 2; allowed: 0 or 1"),
        ({"mode": "raw"}, "mode is 'raw'; allowed: trinary"),
        ({"image": None}, "has no image"),
        ({"image": "other.pgm"}, r"other\.pgm cannot be read: no such file; allowed: a complete PGM"),
        ({"free_thresh": None}, "has no free_thresh; allowed: a mapping with image"),
        ({"image": "[m.pgm"}, "line .*allowed: valid YAML"),
    ],
)
def test_bad_keys_are_refused(tmp_path: Path, changes: dict, message: str) -> None:
    path = write(tmp_path, PIXELS, **changes)
    with pytest.raises(StarnavError, match=message) as error:
        read_map(path)
    assert "\n" not in str(error.value)


@pytest.mark.parametrize(
    ("image", "message"),
    [
        (b"P5\n3 2\n255\n" + PIXELS.tobytes()[:-1], "cannot be read: .*truncated"),
        (b"P2\n3 2\n255\n0 254 205 254 0", "cannot be read"),
        (b"P5\n3\n", "cannot be read|another format"),
        (b"P6\n1 1\n255\n\x00\x00\x00", "is a colour or bit map; allowed: .*PGM"),
        (b"GIF89a and so on", "is of another format; allowed: .*PGM"),
        (b"", "cannot be read: it is empty"),
        (b"P5\n9000 9000\n255\n", "has 9000 x 9000 pixels; allowed: at most 25000000"),
        (b"P5\n90000 90000\n255\n", "cannot be read: .*pixels"),
    ],
)
def test_bad_images_are_refused(tmp_path: Path, image: bytes, message: str) -> None:
    with pytest.raises(StarnavError, match=message) as error:
        read_map(write(tmp_path, image))
    assert "\n" not in str(error.value)
