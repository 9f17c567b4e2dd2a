import numpy as np
from ui.page_client import CableSource, cable_mask, wait_for

from dloftbs import Pipeline
from dloftbs.ui.frame_store import FrameStore
from dloftbs.ui.strip import Strip
from dloftbs.ui.tune_document import TuneDocument


def test_a_probability_that_is_nowhere_0_is_not_doubted():
    def segment(frame):
        return np.where(cable_mask(0.03 * frame.index), 0.97, 0.02).astype(np.float32)

    told = []
    store = FrameStore(CableSource(3))
    strip = Strip(store, lambda _: segment, lambda _: Pipeline(), told.append)
    store.start()
    strip.start(TuneDocument())
    try:
        wait_for(lambda: told and told[-1].done)
    finally:
        strip.close()
        store.stop()
        store.close()
    assert (told[-1].objects, told[-1].warnings) == ([(0, 1), (1, 1), (2, 1)], [])
