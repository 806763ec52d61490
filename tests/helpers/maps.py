"""Maps as files, as map_saver writes them."""

from pathlib import Path

import numpy as np

from drake_starnav.worlds.formats.ros_map import FREE, OCCUPIED, OccupancyMap


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
