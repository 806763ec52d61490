"""Reads occupancy maps in the format of ROS's map_server: a YAML file and the PGM, PNG or BMP image that it names.

Source: wiki.ros.org/map_server, and `map_io.cpp` of navigation2/nav2_map_server.
"""

import io
import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from drake_starnav.errors import StarnavError, shown
from drake_starnav.geometry.se2 import find_pose_in_frame, transform_points
from drake_starnav.parameters import is_number
from drake_starnav.utils.files import explain_read_errors, read_bytes, read_text
from drake_starnav.utils.yaml_text import load_yaml
from drake_starnav.worlds.world import check_keys, check_numbers

FREE, OCCUPIED, UNKNOWN = 0, 100, -1
"""What a cell may be, the values of ROS's `OccupancyGrid`."""
IMAGES = (".pgm", ".png", ".bmp")
FINEST, COARSEST = 1e-3, 100.0
"""Sides that cells may have, m."""
LARGEST_MAP = 25_000_000
"""Cells."""


@dataclass(frozen=True)
class OccupancyMap:
    """A grid of square cells, each free, occupied or unknown.

    Attributes:
        cells: shape (ny, nx), int8, of FREE, OCCUPIED and UNKNOWN; `cells[0, 0]` lies at the origin, x is along rows.
        resolution: side of a cell, m.
        origin: (x, y, yaw) in W of the outer corner of `cells[0, 0]`, m and rad.
    """

    cells: np.ndarray
    resolution: float
    origin: tuple[float, float, float]

    def to_world(self, points: np.ndarray) -> np.ndarray:
        """Points given in cells along x and y, shape (..., 2), in W, m."""
        flat = self.resolution * np.reshape(points, (-1, 2))
        return transform_points(np.array(self.origin), flat).reshape(np.shape(points))

    def find_cell(self, point: tuple[float, float]) -> tuple[int, int] | None:
        """Indices of `cells` at a point (x, y) of W, m; None outside the map."""
        x, y, _ = find_pose_in_frame(np.array(self.origin), np.array((*point, 0.0)))
        row, column = math.floor(y / self.resolution), math.floor(x / self.resolution)
        is_inside = 0 <= row < self.cells.shape[0] and 0 <= column < self.cells.shape[1]
        return (row, column) if is_inside else None


def read_map(path: Path) -> OccupancyMap:
    """The map of a map_server YAML file; its image is found relative to it.

    Raises:
        StarnavError: the file or its image is missing, broken or of another format, a key is missing or its value
            not allowed, or the map is too large.
    """
    keys = _read_yaml(path)
    resolution = _read_number(keys, "resolution", path)
    if not FINEST <= resolution <= COARSEST:
        raise StarnavError(f"map {path}: resolution is {resolution:g}; allowed: {FINEST:g} <= x <= {COARSEST:g} m")
    x, y, yaw = check_numbers(keys["origin"], f"map {path}: origin", ("x", "y", "yaw"))
    free_threshold, occupied_threshold = (
        _read_number(keys, "free_thresh", path),
        _read_number(keys, "occupied_thresh", path),
    )
    if not 0.0 <= free_threshold <= occupied_threshold <= 1.0:
        raise StarnavError(
            f"map {path}: free_thresh is {free_threshold:g}, occupied_thresh is {occupied_threshold:g}; "
            "allowed: 0 <= free_thresh <= occupied_thresh <= 1"
        )
    is_negated = keys.get("negate", 0)
    if is_negated not in (0, 1):
        raise StarnavError(f"map {path}: negate is {shown(is_negated)}; allowed: 0 or 1")
    mode = keys.get("mode", "trinary")
    if str(mode).lower() != "trinary":
        raise StarnavError(f"map {path}: mode is {shown(mode)}; allowed: trinary")
    if not isinstance(keys["image"], str):
        raise StarnavError(f"map {path}: image is {shown(keys['image'])}; allowed: a path relative to the map's folder")
    brightness = read_brightness(path.parent / keys["image"])
    darkness = brightness if is_negated else 1.0 - brightness
    cells = np.full(darkness.shape, UNKNOWN, np.int8)
    cells[darkness > occupied_threshold] = OCCUPIED
    cells[darkness < free_threshold] = FREE
    return OccupancyMap(cells[::-1].copy(), resolution, (x, y, yaw))


def read_brightness(path: Path) -> np.ndarray:
    """Brightness of a PGM (P2, P5), PNG or BMP image, in which opacity counts as a fourth colour if any is transparent.

    It is of shape (ny, nx), 0 to 1, the upper row first. A `StarnavError` if the file is missing, broken, of another
    format or size than it says, or too large.
    """
    from PIL import Image  # late: only maps need it

    place, allowed_text = f"map image {path}", "a complete PGM (P2 or P5), PNG or BMP image"
    data = io.BytesIO(read_bytes(path, place, allowed_text))
    with explain_read_errors(place, allowed_text):
        try:
            image = Image.open(data, formats=("PPM", "PNG", "BMP"))
        except Image.UnidentifiedImageError:
            raise StarnavError(f"{place} is of another format; allowed: {allowed_text}") from None
        with image as image:
            if image.format == "PPM" and image.get_format_mimetype() != "image/x-portable-graymap":
                raise StarnavError(f"{place} is a colour or bit map; allowed: {allowed_text}")
            if image.width * image.height > LARGEST_MAP:
                raise StarnavError(f"{place} has {image.width} x {image.height} pixels; allowed: at most {LARGEST_MAP}")
            image.load()
            return _average_colors(image)


def _average_colors(image: Any) -> np.ndarray:
    if image.mode in ("P", "LA") or "transparency" in image.info:
        image = image.convert("RGBA")
    elif image.mode == "1":
        image = image.convert("L")
    pixels = np.asarray(image) / (65535.0 if image.mode.startswith("I") else 255.0)
    if image.mode == "RGBA" and (pixels[..., 3] == 1.0).all():
        pixels = pixels[..., :3]
    return pixels if pixels.ndim == 2 else pixels.mean(axis=-1)


def _read_yaml(path: Path) -> dict[str, Any]:
    if path.suffix.lower() in IMAGES:
        raise StarnavError(f"map {path} is an image; allowed: the map's YAML file, which names its image")
    keys = load_yaml(read_text(path, f"map {path}"), f"map {path}")
    check_keys(keys, f"map {path}", ("image", "resolution", "origin", "occupied_thresh", "free_thresh"))
    return keys


def _read_number(keys: dict[str, Any], key: str, path: Path) -> float:
    value = keys[key]
    if not is_number(value):
        raise StarnavError(f"map {path}: {key} is {shown(value)}; allowed: a finite number")
    return float(value)
