"""Passages: openings that the full margin would close and a smaller one leaves open."""

from drake_starnav.geometry.compiled import kernel

PASSAGE_DEPTH = 0.8
"""A passage extends the free range by more than this, in radii of the robot."""
SHUT = 2.0
"""A passage is closed if the free range in front of it is shorter than this, in radii. A robot that can drive farther
looks again from there."""
MARGIN_STEPS = 2
"""Number of margins tried in a passage, from the largest to the smallest."""


@kernel
def add_passages(free_range, narrow_range, radius):
    """Return the free range with the passages that only a narrower robot fits through, and whether there are any.

    A passage is a run of bearings at which the narrower robot gets farther by more than PASSAGE_DEPTH. The wider robot
    gets less far than SHUT at every bearing of the run and at both its neighbours: elsewhere the narrower robot would
    only cut a corner.

    Args:
        free_range, narrow_range: shape (M,), free range of the wider and of the narrower robot, m.
        radius: of the robot, m.
    """
    n = len(free_range)
    opened_range = free_range.copy()
    deeper = narrow_range > free_range + PASSAGE_DEPTH * radius
    has_passages = False
    start = 0
    while start < n and deeper[start]:
        start += 1
    if start == n:  # at all bearings: the wider robot cannot move
        return narrow_range.copy(), True
    k = start
    while k < start + n:
        if not deeper[k % n]:
            k += 1
            continue
        first_sample = k
        reached_range = free_range[(first_sample - 1) % n]
        while deeper[k % n]:
            reached_range = max(reached_range, free_range[k % n])
            k += 1
        reached_range = max(reached_range, free_range[k % n])
        if reached_range < SHUT * radius:
            has_passages = True
            for i in range(first_sample, k):
                opened_range[i % n] = narrow_range[i % n]
    return opened_range, has_passages
