"""Passages: openings that the full margin would close and a smaller one leaves open."""

import math

import numpy as np
from numba import njit

PASSAGE_DEPTH = 0.2
"""A passage extends the free range by more than this, m."""
SHUT = 0.5
"""A passage is closed if the free range in front of it is shorter than this, m. A robot that can drive farther looks
again from there."""
MARGIN_STEPS = 2
"""Number of margins tried in a passage, from the largest to the smallest."""


@njit(cache=True)
def opened_passages(free, margin, least, hits, radius, limit, tables):
    """The free range with its passages opened, shape (M,), m, and the smallest margin kept, m.

    Only where the free range is shorter than SHUT can a passage be closed: the narrower robot is looked at nowhere
    else.

    Args:
        free: free range with the full margin, shape (M,), m.
        margin: the full margin, m.
        least: smallest margin allowed in a passage, m; from `margin` on no passage is opened.
        hits: distance, half gap and offset, each of shape (M,), as in `BearingHits`.
        radius: of the robot, without margin, m.
        limit: shape (M,), upper bound of the free range, m.
        tables: cos and sin^2 of the bearings from 0 on, each of shape (M,).
    """
    if least >= margin or free.min() >= SHUT:
        return free, margin
    narrowest = _where_deeper(free, hits, radius + least, limit, tables)
    if not with_passages(free, narrowest)[1]:
        return free, margin
    kept = margin
    for step in range(1, MARGIN_STEPS + 1):
        tried = margin + (least - margin) * step / MARGIN_STEPS
        narrow = narrowest
        if step < MARGIN_STEPS:
            narrow = _where_deeper(free, hits, radius + tried, limit, tables)
        free, opened = with_passages(free, narrow)
        if opened:
            kept = tried
    return free, kept


@njit(cache=True)
def _where_deeper(free, hits, radius, limit, tables):
    """The free range of a narrower robot where it is deeper by more than PASSAGE_DEPTH; elsewhere something less."""
    out = np.zeros(len(free))
    for k in range(len(free)):
        if free[k] < SHUT:
            out[k] = _range_at(k, free[k] + PASSAGE_DEPTH, hits, radius, limit[k], tables)
    return out


@njit(cache=True)
def _range_at(k, enough, hits, radius, limit, tables):
    """What `eroded_range` has at bearing k, if it is more than `enough`; the nearest bearings usually decide."""
    distance, gap, offset = hits
    cosine, sine_squared = tables
    samples = len(distance)
    found = limit
    for i in range(samples // 4 + 1):
        if found <= enough:
            break
        for j in (k + i - samples if k + i >= samples else k + i, k - i if k >= i else k - i + samples):
            d = distance[j]
            if d == np.inf:
                continue
            inflated = radius + d * offset[j]
            squared = inflated * inflated + gap[j] * gap[j]
            if d * d <= squared:
                return 0.0
            under = squared - d * d * sine_squared[i]
            if under >= 0.0:
                found = min(found, d * cosine[i] - math.sqrt(under))
    return found


@njit(cache=True)
def with_passages(free, narrow):
    """The free range with the passages that only a narrower robot fits through, and whether there are any.

    A passage is a run of bearings at which the narrower robot gets farther by more than PASSAGE_DEPTH. The wider robot
    gets less far than SHUT at every bearing of the run and at both its neighbours: elsewhere the narrower robot would
    only cut a corner.

    Args:
        free, narrow: shape (M,), free range of the wider and of the narrower robot, m.
    """
    n = len(free)
    out = free.copy()
    deeper = narrow > free + PASSAGE_DEPTH
    opened = False
    start = 0
    while start < n and deeper[start]:
        start += 1
    if start == n:  # at all bearings: the wider robot cannot move
        return narrow.copy(), True
    k = start
    while k < start + n:
        if not deeper[k % n]:
            k += 1
            continue
        first = k
        reached = free[(first - 1) % n]
        while deeper[k % n]:
            reached = max(reached, free[k % n])
            k += 1
        reached = max(reached, free[k % n])
        if reached < SHUT:
            opened = True
            for i in range(first, k):
                out[i % n] = narrow[i % n]
    return out, opened
