"""Draw the shipped map models/maps/studio.yaml again, the same each time.

Run: python scripts/maintenance/draw_map.py [FOLDER]
"""

import argparse
from pathlib import Path

import numpy as np

from drake_starnav.utils.resources import model_path
from drake_starnav.worlds.formats.map_file import FREE, OCCUPIED, UNKNOWN, OccupancyMap

RESOLUTION = 0.05
"""Side of a cell, m."""
SIZE = (14.0, 10.0)
"""Of the image, m."""
ROOM = (1.0, 1.0, 13.0, 9.0)
"""Its inside: x_min, y_min, x_max, y_max, m."""
WALLS = (
    (5.0, 1.0, 5.1, 3.2),
    (5.0, 4.4, 5.1, 9.0),
    (5.1, 5.6, 7.4, 5.7),
    (8.6, 5.6, 13.0, 5.7),
    (9.6, 1.0, 9.7, 3.6),
)
"""Inner walls with gaps for doors, likewise."""
FURNITURE = (
    (1.0, 7.6, 3.2, 9.0),
    (1.0, 3.2, 1.6, 5.2),
    (2.6, 2.2, 3.8, 3.0),
    (6.4, 1.0, 7.8, 1.6),
    (6.6, 3.2, 8.0, 4.2),
    (11.0, 2.0, 12.2, 2.8),
    (10.4, 7.0, 12.0, 7.8),
    (6.4, 7.4, 7.0, 9.0),
)
"""Boxes with an unseen interior, likewise."""
PILLARS = ((3.4, 5.6, 0.22), (11.6, 4.4, 0.25), (8.8, 7.6, 0.3), (3.9, 8.0, 0.15))
"""Round things: x, y, radius, m."""
NOISE = 0.03
"""Share of the cells at a wall that a scan blurred."""


def write_map(grid: OccupancyMap, path: Path) -> None:
    """Write a map as a YAML file and, beside it, a PGM image, with the values that map_saver uses."""
    rows, columns = grid.cells.shape
    pixels = np.full((rows, columns), 205, np.uint8)
    pixels[grid.cells == OCCUPIED], pixels[grid.cells == FREE] = 0, 254
    image = path.with_suffix(".pgm")
    image.write_bytes(f"P5\n{columns} {rows}\n255\n".encode() + pixels[::-1].tobytes())
    origin = ", ".join(repr(float(value)) for value in grid.origin)
    path.write_text(
        f"image: {image.name}\nmode: trinary\nresolution: {grid.resolution!r}\norigin: [{origin}]\n"
        "negate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.196\n",
        encoding="utf-8",
    )


def draw_studio() -> OccupancyMap:
    """A studio of three rooms, as if mapped by a lidar."""
    rng = np.random.default_rng(5)
    y, x = (np.mgrid[: round(SIZE[1] / RESOLUTION), : round(SIZE[0] / RESOLUTION)] + 0.5) * RESOLUTION
    cells = np.full(x.shape, UNKNOWN, np.int8)

    def inside(box: tuple[float, float, float, float], grown: float = 0.0) -> np.ndarray:
        x0, y0, x1, y1 = box
        return (x > x0 - grown) & (x < x1 + grown) & (y > y0 - grown) & (y < y1 + grown)

    cells[inside(ROOM, 0.1)] = OCCUPIED

    cells[inside(ROOM)] = FREE
    for wall in WALLS:
        cells[inside(wall)] = OCCUPIED
    for box in FURNITURE:
        cells[inside(box)] = OCCUPIED
        cells[inside(box, -2.0 * RESOLUTION)] = UNKNOWN
    for center_x, center_y, radius in PILLARS:
        distance = np.hypot(x - center_x, y - center_y)
        cells[distance < radius] = OCCUPIED
        cells[distance < radius - 2.0 * RESOLUTION] = UNKNOWN
    solid = cells == OCCUPIED
    beside = np.roll(solid, 1, 0) | np.roll(solid, -1, 0) | np.roll(solid, 1, 1) | np.roll(solid, -1, 1)
    cells[beside & (cells == FREE) & (rng.random(cells.shape) < NOISE)] = OCCUPIED
    return OccupancyMap(cells, RESOLUTION, (-2.0, -2.0, 0.0))


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", nargs="?", type=Path, default=model_path("maps"), help="default: %(default)s")
    write_map(draw_studio(), parser.parse_args().folder / "studio.yaml")
