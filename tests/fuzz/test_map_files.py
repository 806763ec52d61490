"""Whatever a map's YAML and image hold, the reader takes them or refuses them in one sentence."""

import tempfile
from pathlib import Path

import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st

from drake_starnav.errors import StarnavError
from drake_starnav.worlds.formats.map_file import read_map
from tests.helpers.inputs import corpus, fuzzed, mutated, values

KEYS = {
    "image": "m.pgm", "mode": "trinary", "resolution": 0.05, "origin": [0.0, 0.0, 0.0], "negate": 0,
    "occupied_thresh": 0.65, "free_thresh": 0.196,
}  # fmt: skip
IMAGE = b"P5\n4 3\n255\n" + bytes([0, 255, 205, 100] * 3)
PLAIN = b"P2 # made by hand\n3 2\n255\n0 100 255\n205 0 255\n"


def accepted(text: bytes, image: bytes) -> bool:
    """Whether a map is read; any error but StarnavError is a failure."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "m.yaml")
        path.write_bytes(text)
        Path(folder, "m.pgm").write_bytes(image)
        try:
            grid = read_map(path)
        except StarnavError as error:
            assert str(error)
            return False
    assert set(grid.cells.ravel().tolist()) <= set(range(-1, 101))
    return True


def test_the_undamaged_map_is_read():
    assert accepted(yaml.safe_dump(KEYS).encode(), IMAGE) and accepted(yaml.safe_dump(KEYS).encode(), PLAIN)


@fuzzed
@given(st.dictionaries(st.sampled_from([*KEYS, "other"]), values, max_size=3))
def test_any_keys(changes):
    accepted(yaml.safe_dump(KEYS | changes).encode(), IMAGE)


@fuzzed
@given(mutated(yaml.safe_dump(KEYS).encode()))
def test_any_damage_of_the_text(data):
    accepted(data, IMAGE)


@pytest.mark.parametrize("path", corpus("maps"), ids=lambda path: path.name)
def test_the_corpus_is_refused_in_one_sentence(path):
    with pytest.raises(StarnavError) as refusal:
        read_map(path)
    assert "allowed" in str(refusal.value)
