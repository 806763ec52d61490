"""What is thrown at the readers: texts near to what they accept, bytes of any kind, and a corpus of both."""

import os
from pathlib import Path

from hypothesis import HealthCheck, settings
from hypothesis import strategies as st

CORPUS = Path(__file__).parents[1] / "data" / "corpus"
"""Inputs that were once refused badly, or that are likely to be; one folder for each reader."""
EXAMPLES = int(os.environ.get("STARNAV_FUZZ_EXAMPLES", "60"))
"""How many inputs each test makes up; with more than by default, others in each run."""

fuzzed = settings(
    max_examples=EXAMPLES,
    deadline=None,
    derandomize="STARNAV_FUZZ_EXAMPLES" not in os.environ,
    suppress_health_check=list(HealthCheck),
)

scalars = st.one_of(
    st.none(),
    st.booleans(),
    st.integers(-(10**20), 10**20),
    st.floats(),
    st.text(max_size=8),
    st.sampled_from(["", "star", "none", "1e-3", "../../x", "package://x", "~/x", "\0", "!Forest"]),
)
values = st.recursive(
    scalars,
    lambda inner: st.one_of(st.lists(inner, max_size=4), st.dictionaries(scalars, inner, max_size=3)),
    max_leaves=8,
)


@st.composite
def mutated(draw: st.DrawFn, seed: bytes) -> bytes:
    """A valid input with some of its bytes removed, repeated or replaced."""
    data = bytearray(seed)
    for _ in range(draw(st.integers(1, 6))):
        place = draw(st.integers(0, max(len(data) - 1, 0)))
        length = draw(st.integers(0, 12))
        kind = draw(st.sampled_from(["cut", "repeat", "replace", "truncate"]))
        if kind == "cut":
            del data[place : place + length]
        elif kind == "repeat":
            data[place:place] = data[place : place + length] * draw(st.integers(1, 4))
        elif kind == "replace":
            data[place : place + length] = draw(st.binary(max_size=length + 2))
        else:
            del data[place:]
    return bytes(data)


def corpus(kind: str) -> list[Path]:
    """The files of the corpus for a reader."""
    return sorted(path for path in (CORPUS / kind).iterdir() if path.is_file())
