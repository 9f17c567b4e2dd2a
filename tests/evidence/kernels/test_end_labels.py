"""Labels before ends, against a slow twin."""

from __future__ import annotations

from collections import Counter

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from dloftbs.evidence.kernels.end_labels import label_ends

SIZE = (60, 90)


def slowly(labels: np.ndarray, run: np.ndarray, width: float) -> int:
    """Return the label before the end at the first point of a run."""
    seen = []
    at = width
    while int(at) < int(min(8.0 * width, len(run) - 1)):
        x, y = np.floor(run[int(at)] + 0.5).astype(int)
        inside = 0 <= y < SIZE[0] and 0 <= x < SIZE[1]
        seen.append(int(labels[y, x]) if inside else 0)
        at += max(width, 1.0)
    counts = Counter(label for label in seen if label)
    return counts.most_common(1)[0][0] if counts else 0


@given(st.integers(0, 2**31))
def test_each_end_has_the_label_of_the_slow_twin(seed: int) -> None:
    rng = np.random.default_rng(seed)
    labels = np.kron(rng.integers(0, 4, (6, 9)), np.ones((10, 10))).astype(np.uint16)
    width = rng.uniform(0.5, 9.0)
    runs = []
    for _ in range(3):
        start, stop = rng.uniform(-5.0, 65.0, (2, 2))
        runs.append(np.linspace(start, stop, int(rng.integers(2, 90))))
    stops = np.cumsum([len(run) for run in runs])
    spans = np.column_stack((stops - [len(run) for run in runs], stops))
    expected = [slowly(labels, run[::way], width) for run in runs for way in (1, -1)]
    assert label_ends(labels, np.concatenate(runs), spans, width).tolist() == expected
