"""Selection of the centre lines that are objects."""

from __future__ import annotations

from collections.abc import Sequence

from dloftbs.config import ObjectsConfig
from dloftbs.data.centerline import Centerline


def choose(lines: Sequence[Centerline], config: ObjectsConfig) -> tuple[list[Centerline], tuple[Centerline, ...]]:
    """Leave out objects that are too short, and keep the longest where the number of objects is known.

    Parameters
    ----------
    lines : sequence of Centerline
        Of either method.
    config : ObjectsConfig

    Returns
    -------
    kept : list of Centerline
        In the order given.
    dropped : tuple of Centerline
        Objects that are long enough, but exceed the number.
    """
    lengths = [sum(map(len, line.segments)) for line in lines]  # points are about 1 px apart
    enough = [
        k
        for k, line in enumerate(lines)
        if lengths[k] >= max(config.min_length_px, config.min_length_widths * line.width_px)
    ]
    best = sorted(enough, key=lambda k: -lengths[k])[: config.objects]
    kept = [lines[k] for k in sorted(best)]
    return kept, tuple(lines[k] for k in enough if k not in best)
