"""Chunks are unpacked as far as they go, and no further than the file says that they do."""

from __future__ import annotations

import bz2
import sqlite3
import tracemalloc
from pathlib import Path

import lz4.frame
import numpy as np
import pytest
import zstandard
from ros import bag_examples as bags

from dloftbs.ros import bag_file
from dloftbs.ros.bag_file import MAX_RECORD_BYTES, CutError, decompressed
from dloftbs.ros.recording import Recording

PACK = {"zstd": zstandard.ZstdCompressor().compress, "lz4": lz4.frame.compress, "bz2": bz2.compress}
CONTENT = np.random.default_rng(0).integers(0, 8, 3_000_000, np.uint8).tobytes()
MIN_SHARE = {"zstd": 0.4, "lz4": 0.4, "bz2": 0.25}
"""Of the content, what the first half of the packed bytes gives at least; bzip2 gives whole blocks of 900 kB."""


@pytest.mark.parametrize("kind", PACK)
def test_a_whole_chunk_and_one_that_is_cut_off(kind: str) -> None:
    packed = memoryview(PACK[kind](CONTENT))
    assert decompressed(kind, packed, len(CONTENT)) == (CONTENT, True)
    for cut in (packed[: len(packed) // 2], packed[:9], packed[:0]):
        found, is_all = decompressed(kind, cut, len(CONTENT))
        assert not is_all
        assert CONTENT.startswith(found)
    assert len(decompressed(kind, packed[: len(packed) // 2], len(CONTENT))[0]) > MIN_SHARE[kind] * len(CONTENT)


@pytest.mark.parametrize("kind", PACK)
def test_what_stands_before_damage_is_kept(kind: str) -> None:
    packed = bytearray(PACK[kind](CONTENT))
    at = 3 * len(packed) // 4
    packed[at : at + 64] = bytes(64)
    found, is_all = decompressed(kind, packed, len(CONTENT))
    sure = int(MIN_SHARE[kind] * len(CONTENT))
    assert found[:sure] == CONTENT[:sure]
    assert not is_all or kind == "lz4"  # whose blocks have no checksum


@pytest.mark.parametrize("kind", PACK)
def test_more_content_than_the_file_says_is_not_unpacked(kind: str) -> None:
    packed = PACK[kind](bytes(1 << 26))
    tracemalloc.start()
    found, is_all = decompressed(kind, packed, 1 << 20)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert (len(found), is_all) == ((1 << 20) + 1, False)
    assert peak < 1 << 23
    with pytest.raises(CutError, match="1073741824 at most"):
        decompressed(kind, packed, MAX_RECORD_BYTES + 1)


def test_an_unknown_compression() -> None:
    with pytest.raises(CutError, match="unknown compression 'brotli'"):
        decompressed("brotli", b"", 9)


@pytest.mark.parametrize("states_size", [True, False])
def test_a_message_that_is_packed_by_itself_is_not_unpacked_beyond_the_limit(
    states_size: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (path,) = bags.write_ros2(tmp_path / "run", bags.entries(3, depth=False, info=False), "sqlite3").glob("*.db3")
    pack = zstandard.ZstdCompressor(write_content_size=states_size).compress
    with sqlite3.connect(path) as database:
        for number, content in enumerate((pack(CONTENT), pack(bytes(1 << 26)), pack(CONTENT)[:9]), 1):
            database.execute("UPDATE messages SET data = ? WHERE id = ?", (content, number))
    database.close()
    monkeypatch.setattr(bag_file, "MAX_RECORD_BYTES", 1 << 22)
    tracemalloc.start()
    found = [bytes(raw.data) for raw in Recording(path).messages({bags.COLOUR_TOPIC})]
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert found[0] == CONTENT
    assert len(found[1]) <= 1 << 22
    assert len(found) == 3
    assert peak < 1 << 25
