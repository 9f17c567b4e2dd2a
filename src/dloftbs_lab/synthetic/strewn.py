"""The shapes of several cables strewn over a table: smooth arcs, few crossings, some cut by the border."""

from __future__ import annotations

import math

import numpy as np

from dloftbs.support.arrays import FloatArray
from dloftbs_lab.synthetic.generated import proportion
from dloftbs_lab.synthetic.strand import Strand, integrate, random_heading
from dloftbs_lab.synthetic.tangle import Table, draw_beside, is_covered

# In px of an image of 1280 x 720, as the photographs of Ariadne have them at 640 x 480.
_LENGTH = (360.0, 780.0)
_MIN_RADIUS = 115.0
_MIN_SHOWN = 150.0
_BESIDE = 0.06
"""Share of the cables that run along another, touching it."""
_ATTEMPTS = 200


def draw_strewn(rng: np.random.Generator, cables: int, size: tuple[int, int], width_px: float) -> tuple[Strand, ...]:
    """Lay cables on a table, in an image of `size` (H, W); the lowest comes first.

    They lie anywhere, and what is out of the image is cut off; one in seventeen runs along another for a stretch.
    """
    table = Table(size, proportion(size), width_px)
    strands: list[Strand] = []
    while len(strands) < cables:
        strands.append(_draw_one(rng, strands, table))
    return tuple(strands)


def _draw_one(rng: np.random.Generator, strands: list[Strand], table: Table) -> Strand:
    """Return a cable that shows enough; it lies on none of the others, unless no place is found for that."""
    is_beside = bool(strands) and rng.random() < _BESIDE
    attempts = 0
    while True:
        attempts += 1
        laid = draw_beside(rng, strands, table) if is_beside and attempts <= _ATTEMPTS else _anywhere(rng, table)
        shown = None if laid is None else _inside(laid, table)
        if shown is None:
            continue
        if attempts >= _ATTEMPTS or not strands or not is_covered(shown, strands, table.width_px):
            return shown


def _anywhere(rng: np.random.Generator, table: Table) -> Strand:
    length = table.scale * float(rng.uniform(*_LENGTH))
    along = np.linspace(0.0, 1.0, max(64, math.ceil(2.0 * length)))
    strand = integrate(random_heading(rng, along, length, _MIN_RADIUS * table.scale), length)
    middle: FloatArray = strand.points[len(along) // 2]
    return strand.moved(rng.uniform((0.0, 0.0), table.size[::-1]) - middle)


def _inside(strand: Strand, table: Table) -> Strand | None:
    """Return the longest part within the image, or None where it is too short to count as a cable."""
    within = ((strand.points >= 0.0) & (strand.points <= np.array(table.size[::-1]) - 1.0)).all(axis=1)
    edges = np.flatnonzero(np.diff(within.astype(np.int8), prepend=0, append=0))
    runs = edges.reshape(-1, 2)
    if not len(runs):
        return None
    first, last = runs[np.argmax(runs[:, 1] - runs[:, 0])]
    shown = Strand(strand.points[first:last], strand.heading[first:last], strand.spacing)
    return shown if shown.length >= _MIN_SHOWN * table.scale else None
