"""Which regions may cover a place: a coarse grid over W, so that queries of the union look at a few regions only.

The index only rules regions out. What it leaves is tested exactly, so that the answers are those of a loop over all.
"""

import math
from dataclasses import dataclass, field
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numba import njit

from drake_starnav.geometry.compiled import leaf
from drake_starnav.regions.star_region import RegionStack, covers_nearly, covers_offset

CELL = 0.4
"""Size of a cell, m."""
SLACK = 0.07
"""Regions are marked this far beyond their boundaries, m: queries may allow them less than this."""
PATCH = 0.2
"""Regions are marked patch by patch, of this length and about this width, m."""
SPARE_CELLS = 8
"""A grid that grows gets so many cells more than it needs on the sides that grow."""
WORD = 64
"""Regions in a word of the grid."""


class IndexedRegions(NamedTuple):
    """Regions and where they may cover, for compiled loops.

    Attributes:
        center, bearing_0, values, reach: as `RegionStack.arrays`.
        marks: shape (nx, ny, w), uint64: bit k % 64 of word k // 64 is set in each cell that region k touches.
        corner: of the first cell, shape (2,), W, m.
        cell: size of a cell, m.
        every: shape (w,), uint64: the bits of all regions.
    """

    center: np.ndarray
    bearing_0: np.ndarray
    values: np.ndarray
    reach: np.ndarray
    marks: np.ndarray
    corner: np.ndarray
    cell: float
    every: np.ndarray

    @staticmethod
    def none() -> "IndexedRegions":
        """No regions."""
        return RegionIndex.empty().of(RegionStack.of(()))


@lru_cache(maxsize=1024)
def _all(count: int) -> np.ndarray:
    """The bits of so many regions."""
    return selection(np.ones(count, bool))


def selection(members: np.ndarray) -> np.ndarray:
    """The bits of the regions that a mask of shape (n,) selects, as in a cell of the grid, shape (w,)."""
    out = np.zeros(len(members) // WORD + 1, np.uint64)
    packed = np.packbits(members, bitorder="little")
    out.view(np.uint8)[: len(packed)] = packed
    return out


class _Storage:
    """Marks that indices share which extend one another; the first to use a bit owns it."""

    def __init__(self, used: int) -> None:
        self.used = used


@dataclass(frozen=True)
class RegionIndex:
    """The marks of the regions of a stack. Immutable; extension shares memory.

    Attributes:
        marks: as in `IndexedRegions`; bits from `count` on are of no meaning.
        first: cell of the grid over W that comes first, shape (2,).
        count: number of regions.
    """

    marks: np.ndarray = field(compare=False)
    first: np.ndarray
    count: int
    storage: _Storage = field(compare=False)

    @staticmethod
    def empty() -> "RegionIndex":
        """Of no regions."""
        return RegionIndex(np.zeros((0, 0, 1), np.uint64), np.zeros(2, np.int64), 0, _Storage(0))

    def of(self, stack: RegionStack) -> IndexedRegions:
        """The regions of the stack whose marks these are."""
        return IndexedRegions(*stack.arrays, self.marks, CELL * self.first, CELL, _all(len(stack)))

    def appended(self, stack: RegionStack) -> "RegionIndex":
        """These marks and those of the last region of a stack."""
        low, high = _box(stack, np.array([self.count]))
        marks, first, storage = self.marks, self.first, self.storage
        if storage.used != self.count or not self._holds(low, high, self.count + 1):
            marks, first = self._widened(low, high, 2 * (self.count + 1), selection(np.ones(self.count, bool)))
            storage = _Storage(self.count)
        storage.used = self.count + 1
        _mark(marks, first, self.count, *(array[self.count] for array in stack.arrays[:3]))
        return RegionIndex(marks, first, self.count + 1, storage)

    def revised(self, kept: np.ndarray, changed: np.ndarray, stack: RegionStack) -> "RegionIndex":
        """The marks after regions were changed or dropped.

        Args:
            kept: shape (n,), indices of the regions that remain.
            changed: shape (n,), whether such a region has changed.
            stack: the regions that remain.
        """
        news = np.flatnonzero(changed)
        low, high = _box(stack, news)
        number = np.full(self.count, -1)
        number[kept[~changed]] = np.flatnonzero(~changed)
        staying = number == np.arange(self.count)
        moving = ~staying & (number >= 0)
        marks, first = self._widened(low, high, self.count, selection(staying))
        if moving.any():
            i, j = self.first - first
            nx, ny, _ = self.marks.shape
            _move(self.marks, marks[i : i + nx, j : j + ny], selection(moving), number)
        for k in news.tolist():
            _mark(marks, first, k, *(array[k] for array in stack.arrays[:3]))
        return RegionIndex(marks, first, len(stack), _Storage(len(stack)))

    def _holds(self, low: np.ndarray, high: np.ndarray, count: int) -> bool:
        """Whether the grid has the cells from `low` to `high` and bits for so many regions."""
        shape = self.marks.shape
        inside = (low >= self.first).all() and (high <= self.first + shape[:2]).all()
        return bool(inside) and count < WORD * shape[2]

    def _widened(
        self, low: np.ndarray, high: np.ndarray, count: int, staying: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """A copy of the marks of a selection, and its first cell.

        It has the cells from `low` to `high` too, and bits for `count` regions.
        """
        first, last = self.first, self.first + self.marks.shape[:2]
        if not self.marks.size:
            first, last = low, low
        new_first = np.where(low < first, low - SPARE_CELLS, first)
        new_last = np.where(high > last, high + SPARE_CELLS, last)
        marks = np.zeros((*(new_last - new_first), max(self.marks.shape[2], count // WORD + 1)), np.uint64)
        i, j = first - new_first
        nx, ny, _ = self.marks.shape
        words = len(staying)
        np.bitwise_and(self.marks[:, :, :words], staying, out=marks[i : i + nx, j : j + ny, :words])
        return marks, new_first


def _box(stack: RegionStack, members: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The first cell and the one beyond the last that regions of a stack may touch."""
    if not len(members):
        nothing = np.zeros(2, np.int64)
        return nothing, nothing
    low, high = _outline_box(*stack.arrays[:3], members)
    return np.floor(low / CELL).astype(np.int64), np.floor(high / CELL).astype(np.int64) + 1


@njit(cache=True)
def alone(center, bearing_0, values):
    """A single region without a grid, where an index does not pay: it may cover any place."""
    return IndexedRegions(
        center.reshape((1, 2)),
        np.full(1, bearing_0),
        values.reshape((1, len(values))),
        np.full(1, np.inf),
        np.ones((1, 1, 1), np.uint64),
        np.zeros(2),
        np.inf,
        np.ones(1, np.uint64),
    )


@njit(cache=True)
def marks_at(regions, x, y):
    """Words with the bits of the regions that may cover (x, y)."""
    i, j = math.floor((x - regions.corner[0]) / regions.cell), math.floor((y - regions.corner[1]) / regions.cell)
    if i < 0 or j < 0 or i >= regions.marks.shape[0] or j >= regions.marks.shape[1]:
        return np.zeros(len(regions.every), np.uint64)
    return regions.marks[i, j, : len(regions.every)]


@njit(cache=True)
def newest_cover(regions, x, y):
    """Index of the newest region that contains (x, y), or -1; as `first_cover`."""
    return newest_near(regions, x, y, 0.0, -1, regions.every)


@njit(cache=True)
def newest_near(regions, x, y, slack, other, among):
    """As `newest_cover`, but up to `slack` (< SLACK) beyond its boundary, not `other`, and of a `selection`."""
    u = regions
    return newest_of(u.center, u.bearing_0, u.values, u.reach, u.marks, u.corner, u.cell, x, y, slack, other, among)


@leaf
def covers_within(center, bearing_0, values, reach, k, x, y, slack):
    """Whether region k covers (x, y) up to `slack` beyond its boundary, m."""
    dx, dy = x - center[k, 0], y - center[k, 1]
    if dx * dx + dy * dy > (reach[k] + slack) ** 2:
        return False
    return covers_nearly(center, bearing_0, values, k, dx, dy, slack)


@njit(cache=True, error_model="numpy")
def newest_of(center, bearing_0, values, reach, marks, corner, cell, x, y, slack, other, among):
    """As `newest_near`, for use in loops, where to read arrays from a tuple each time would cost more than the rest."""
    i, j = math.floor((x - corner[0]) / cell), math.floor((y - corner[1]) / cell)
    if i < 0 or j < 0 or i >= marks.shape[0] or j >= marks.shape[1]:
        return -1
    for w in range(len(among) - 1, -1, -1):
        word = marks[i, j, w] & among[w]
        while word != 0:
            bit = top_bit(word)
            word ^= np.uint64(1) << np.uint64(bit)
            k = w * WORD + bit
            dx, dy = x - center[k, 0], y - center[k, 1]
            squared = dx * dx + dy * dy
            if k == other or squared > (reach[k] + slack) ** 2:
                continue
            if slack > 0.0:
                if covers_nearly(center, bearing_0, values, k, dx, dy, slack):
                    return k
            elif covers_offset(bearing_0, values, k, dx, dy):
                return k
    return -1


@njit(cache=True)
def top_bit(word):
    """Index of the highest bit that is set."""
    bit = 0
    for shift in (32, 16, 8, 4, 2, 1):
        if word >> np.uint64(shift):
            word >>= np.uint64(shift)
            bit += shift
    return bit


@njit(cache=True)
def _outline_box(center, bearing_0, values, members):
    """Corners of a box that holds all patches of some regions."""
    samples = values.shape[1]
    step = 2.0 * math.pi / samples
    low, high = np.full(2, np.inf), np.full(2, -np.inf)
    for k in members:
        farthest = 0.0
        for i in range(samples):
            x = center[k, 0] + values[k, i] * math.cos(bearing_0[k] + i * step)
            y = center[k, 1] + values[k, i] * math.sin(bearing_0[k] + i * step)
            low[0], low[1] = min(low[0], x), min(low[1], y)
            high[0], high[1] = max(high[0], x), max(high[1], y)
            farthest = max(farthest, values[k, i])
    border = 3.0 * PATCH + SLACK + 2.0 * step * farthest
    return low - border, high + border


@njit(cache=True)
def _mark(marks, first, k, center, bearing_0, values):
    """Set the bit of region k in each cell that it touches.

    It is covered patch by patch: in rings whose radius doubles, by so many samples at once that they are about as wide
    as PATCH.
    """
    samples = len(values)
    step = 2.0 * math.pi / samples
    _mark_box(marks, first, k, center[0], center[1], PATCH + SLACK)
    low = PATCH
    farthest = values.max()
    while low < farthest:
        high = 2.0 * low
        together = max(int(PATCH / (high * step)), 1)
        half = 0.5 * math.hypot(PATCH, together * step * high) + SLACK
        for begin in range(0, samples, together):
            most = 0.0
            for i in range(begin, min(begin + together, samples) + 1):
                most = max(most, values[i if i < samples else 0])
            if most <= low:
                continue
            bearing = bearing_0 + step * (begin + 0.5 * together)
            ux, uy = math.cos(bearing), math.sin(bearing)
            r = low
            while r < min(most, high):
                middle = r + 0.5 * PATCH
                _mark_box(marks, first, k, center[0] + middle * ux, center[1] + middle * uy, half)
                r += PATCH
        low = high


@njit(cache=True)
def _mark_box(marks, first, k, x, y, half):
    word, bit = k // WORD, np.uint64(1) << np.uint64(k % WORD)
    for i in range(math.floor((x - half) / CELL) - first[0], math.floor((x + half) / CELL) - first[0] + 1):
        for j in range(math.floor((y - half) / CELL) - first[1], math.floor((y + half) / CELL) - first[1] + 1):
            marks[i, j, word] |= bit


@njit(cache=True)
def _move(before, marks, moving, number):
    """Set the bits of a selection of regions at their new numbers in cells in which the old ones were set."""
    nx, ny, _ = before.shape
    for i in range(nx):
        for j in range(ny):
            for w in range(len(moving)):
                word = before[i, j, w] & moving[w]
                while word != 0:
                    bit = top_bit(word)
                    word ^= np.uint64(1) << np.uint64(bit)
                    new = number[w * WORD + bit]
                    marks[i, j, new // WORD] |= np.uint64(1) << np.uint64(new % WORD)
