"""Places of labels."""

from __future__ import annotations

from collections.abc import Callable
from time import process_time

import numpy as np

from dloftbs.viz.label_placement import place

ROOM = (0, 0, 4000, 2000)


def test_what_lies_far_off_costs_one_look() -> None:
    """Among 100 cables in 4K, labels took longer than everything else of a picture."""
    busy = np.random.default_rng(0).uniform((500.0, 0.0), (4000.0, 2000.0), (300_000, 2))

    def look() -> object:
        return np.all((busy >= 0.0) & (busy < 10.0), axis=1)

    def put() -> object:
        return place(np.array([100.0, 1000.0]), 10.0, (60, 30), busy=busy, taken=(), room=ROOM)

    assert _fastest_s(put) < 3.0 * _fastest_s(look)


def test_a_label_avoids_curves_first_and_other_labels_above_all() -> None:
    anchor, size = np.array([100.0, 100.0]), (40, 20)
    free = place(anchor, 10.0, size, busy=np.empty((0, 2)), taken=(), room=ROOM)
    left, top = free[:2]
    beside = place(anchor, 10.0, size, busy=np.array([(left, top)], np.float64), taken=(), room=ROOM)
    assert beside != free
    everywhere = np.stack(np.meshgrid(np.arange(300.0), np.arange(300.0)), axis=-1).reshape(-1, 2)
    everywhere = everywhere[~((everywhere >= (left, top)) & (everywhere < (left + 40, top + 20))).all(axis=1)]
    assert place(anchor, 10.0, size, busy=everywhere, taken=(), room=ROOM) == free
    assert place(anchor, 10.0, size, busy=everywhere, taken=(free,), room=ROOM) != free


def _fastest_s(call: Callable[[], object]) -> float:
    spent = []
    for _ in range(5):
        since = process_time()
        call()
        spent.append(process_time() - since)
    return min(spent)
