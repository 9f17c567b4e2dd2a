import logging
from threading import Thread

import numpy as np
import pytest
from ui.page_client import SIZE, CableSource

from dloftbs import sources
from dloftbs.errors import SourceError
from dloftbs.ui.frame_store import MAX_SAMPLES, FrameStore

FRAME_BYTES = 3 * SIZE[0] * SIZE[1]


@pytest.fixture
def opened():
    stores = []

    def make(source, budget=1 << 28, *, started=True):
        stores.append(FrameStore(source, budget))
        if started:
            stores[-1].start()
        return stores[-1]

    yield make
    for store in stores:
        store.close()


def all_samples(store):
    while not store.ended:
        store.wait_for_samples(10**9, 0.05)
    return [frame.index for frame in store.samples()]


@pytest.mark.parametrize(
    ("count", "budget_frames", "known", "expected"),
    [
        (12, 100, True, list(range(12))),
        (12, 4, True, [0, 3, 6, 9]),
        (12, 5, True, [0, 3, 6, 9]),
        (12, 5, False, [0, 4, 8]),
        (3 * MAX_SAMPLES, 10**4, True, list(range(0, 3 * MAX_SAMPLES, 3))),
    ],
)
def test_a_sample_is_even_and_within_memory(opened, count, budget_frames, known, expected):
    store = opened(CableSource(count, known_length=known), budget_frames * FRAME_BYTES)
    assert all_samples(store) == expected
    assert store.length == count


def test_any_frame_of_a_recording_can_be_had(opened):
    source = CableSource(12)
    store = opened(source, 2 * FRAME_BYTES, started=False)
    for index in (0, 7, 3, 11, 11, 2, 0):
        frame = store.frame(index)
        assert frame.index == index
        assert np.array_equal(frame.image, source.frame(index).image)
    assert store.frame(None).index == 0
    assert store.frame(400).index == 11


def test_looking_on_does_not_begin_anew(opened):
    source = CableSource(12)
    store = opened(source, started=False)
    for index in (*range(12), *range(11, -1, -1)):
        assert store.frame(index).index == index
    assert source.passes == 1


def test_a_frame_that_cannot_be_read_gives_way_to_the_next(opened, tmp_path, caplog):
    import cv2

    for index in range(4):
        cv2.imwrite(str(tmp_path / f"{index}.png"), np.full((*SIZE, 3), 9 * index, np.uint8))
    (tmp_path / "1.png").write_bytes(b"nothing")
    with caplog.at_level(logging.ERROR):
        store = opened(sources.open(tmp_path))
        assert store.frame(1).index == 2
        assert all_samples(store) == [0, 2, 3]


def test_of_a_camera_the_newest_frame_is_had_and_what_was_kept(opened):
    store = opened(CableSource(12, live=True), 4 * FRAME_BYTES)
    all_samples(store)
    assert store.frame(None).index == 11
    assert store.frame(5).index in (4, 6)
    store.keep(CableSource().frame(5))
    assert store.frame(5).index == 5


def test_a_camera_s_frame_that_is_drawn_on_stays(opened):
    store = opened(CableSource(40, live=True), 4 * FRAME_BYTES)
    all_samples(store)
    store.keep(CableSource().frame(5))
    store.pin(5)
    for index in range(6, 30):
        store.keep(CableSource().frame(index))
    assert store.frame(5).index == 5
    with pytest.raises(SourceError, match=r"cable\.mp4: frame 7 is no longer kept"):
        store.pin(7)
    store.unpin_others({5, 8})
    assert store.frame(5).index == 5
    store.unpin_others({8})
    assert store.frame(5).index != 5
    opened(CableSource(4), started=False).pin(400)  # of a recording it is read again


def test_a_source_that_can_be_read_only_once_is_kept_as_a_camera(opened):
    class Once(CableSource):
        single_pass = True

        def __iter__(self):
            assert self.passes == 0
            return super().__iter__()

    store = opened(Once(12, known_length=False), 4 * FRAME_BYTES)
    all_samples(store)
    assert (store.live, store.length) == (True, 12)
    assert [store.frame(index).index for index in (None, 0, 8)] == [11, 0, 8]


def test_nobody_waits_for_a_silent_camera_once_it_is_to_end(opened):
    store = opened(CableSource(12, live=True), started=False)
    failed = []

    def look():
        try:
            store.frame(None)
        except SourceError as error:
            failed.append(error)

    looking = Thread(target=look, daemon=True)
    looking.start()
    store.stop()
    looking.join(10.0)
    assert not looking.is_alive()
    assert len(failed) == 1


@pytest.mark.parametrize("live", [True, False])
def test_a_source_without_frames_says_so(opened, live):
    store = opened(CableSource(0, live=live))
    with pytest.raises(SourceError, match="no frame could be read"):
        store.frame(None)
