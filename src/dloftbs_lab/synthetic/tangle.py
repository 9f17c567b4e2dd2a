"""The shapes of several cables on one another: they cross, run side by side for a stretch, end under others."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from dloftbs.support.arrays import FloatArray
from dloftbs_lab.synthetic.generated import proportion
from dloftbs_lab.synthetic.motion import smoothstep
from dloftbs_lab.synthetic.strand import Strand, integrate, random_heading, random_strand

_SAMPLE_PX = 0.5
_ATTEMPTS = 60
_MARGIN = 14.0
_LENGTH = (420.0, 880.0)
_MIN_RADIUS = 46.0
_BESIDE = (120.0, 280.0)
_THINNING = 8


@dataclass(frozen=True)
class Table:
    """Table under the cables.

    Parameters
    ----------
    size : (int, int)
        ``(H, W)`` of the image, px.
    scale : float
        Pixels per pixel of an image of 1280 x 720.
    width_px : float
        Of the cables.
    """

    size: tuple[int, int]
    scale: float
    width_px: float

    @property
    def margin_px(self) -> float:
        """Distance that cables keep from the image's border."""
        return _MARGIN * self.scale + self.width_px / 2.0

    @property
    def min_radius_px(self) -> float:
        """No bend is tighter: the width of the cable allows no less than its own."""
        return max(_MIN_RADIUS * self.scale, 1.2 * self.width_px)

    def length(self, rng: np.random.Generator) -> float:
        """Draw the length of a cable, px."""
        return self.scale * float(rng.uniform(*_LENGTH))

    def holds(self, strand: Strand) -> bool:
        """Return whether a cable lies inside and does not bend too tightly."""
        inside = (strand.points >= self.margin_px).all() and (
            strand.points <= np.array(self.size[::-1]) - 1.0 - self.margin_px
        ).all()
        return bool(inside) and float(np.abs(strand.bending).max()) * self.min_radius_px <= 1.05


def draw_tangle(rng: np.random.Generator, cables: int, size: tuple[int, int], width_px: float) -> tuple[Strand, ...]:
    """Lay cables on one another, in an image of `size` (H, W); the lowest comes first.

    Of two cables one may run along the other or end under it; of three or more, one at least does each.
    """
    table = Table(size, proportion(size), width_px)
    strands = [random_strand(rng, table.length(rng), size, table.min_radius_px, table.margin_px)]
    for part in _parts(rng, cables):
        strand, lowest = _draw_until_it_fits(part, rng, strands, table)
        strands.insert(0 if lowest else len(strands), strand)
    return tuple(strands)


_Part = Callable[[np.random.Generator, Sequence[Strand], Table], Strand | None]


def _parts(rng: np.random.Generator, cables: int) -> list[_Part]:
    """Choose how each cable after the first lies to those before it."""
    parts: list[_Part] = [_across, draw_beside, _under]
    sure = [draw_beside, _under] if cables > 2 else []
    rest = [parts[i] for i in rng.choice(3, cables - 1 - len(sure), p=(0.6, 0.2, 0.2))]
    return [(sure + rest)[i] for i in rng.permutation(cables - 1)]


def _draw_until_it_fits(
    part: _Part, rng: np.random.Generator, strands: Sequence[Strand], table: Table
) -> tuple[Strand, bool]:
    """Return a cable that fits, and whether it lies below all others."""
    for _ in range(_ATTEMPTS):
        strand = part(rng, strands, table)
        if strand is not None and table.holds(strand) and not is_covered(strand, strands, table.width_px):
            return strand, part is _under
    return random_strand(rng, table.length(rng), table.size, table.min_radius_px, table.margin_px), False


def is_covered(strand: Strand, others: Sequence[Strand], width_px: float) -> bool:
    """Return whether a cable lies on others for more than an eighth of its length: nobody could follow it."""
    tree = cKDTree(np.concatenate([other.points[::_THINNING] for other in others]))
    distance, _ = tree.query(strand.points[::_THINNING])
    return float((distance < 0.7 * width_px).mean()) > 0.12


def _across(rng: np.random.Generator, strands: Sequence[Strand], table: Table) -> Strand | None:
    """Draw a cable that crosses or touches one of the others."""
    strand = random_strand(rng, table.length(rng), table.size, table.min_radius_px, table.margin_px)
    tree = cKDTree(np.concatenate([other.points[::_THINNING] for other in strands]))
    distance, _ = tree.query(strand.points[::_THINNING])
    return strand if distance.min() < table.width_px / 2.0 else None


def _under(rng: np.random.Generator, strands: Sequence[Strand], table: Table) -> Strand | None:
    """Draw a cable whose first end lies under the middle line of another."""
    other = strands[int(rng.integers(len(strands)))]
    at = int(rng.uniform(0.15, 0.85) * (len(other.points) - 1))
    length = 0.8 * table.length(rng)
    heading = random_heading(rng, _even(length), length, table.min_radius_px)
    angle = other.heading[at] + rng.choice((-1.0, 1.0)) * rng.uniform(0.3, 0.7) * math.pi
    return integrate(heading - heading[0] + angle, length).moved(other.points[at])


def draw_beside(rng: np.random.Generator, strands: Sequence[Strand], table: Table) -> Strand | None:
    """Draw a cable that comes up to another, runs along it, touching, and leaves it to the same side."""
    other = strands[int(rng.integers(len(strands)))]
    stretch = table.scale * rng.uniform(*_BESIDE)
    if stretch > 0.6 * other.length:
        return None
    first = int(rng.uniform(0.15, 0.85 - stretch / other.length) * (len(other.points) - 1))
    last = first + int(stretch / other.spacing)
    side = float(rng.choice((-1.0, 1.0)))
    normal = np.stack((-other.tangents[:, 1], other.tangents[:, 0]), axis=1)[first : last + 1]
    path = other.points[first : last + 1] + side * rng.uniform(0.97, 1.12) * table.width_px * normal
    along = np.concatenate(([0.0], np.cumsum(np.linalg.norm(np.diff(path, axis=0), axis=1))))
    arc = _even(along[-1]) * along[-1]
    middle = np.interp(arc, along, other.heading[first : last + 1])
    ahead = _leaving(rng, side, other.bending[last], table)
    behind = _leaving(rng, side, other.bending[first], table)
    # Backwards from the stretch the heading falls where ahead it rises: both ways lead to the same side.
    heading = np.concatenate((middle[0] - behind[:0:-1], middle, middle[-1] + ahead[1:]))
    strand = integrate(heading, _SAMPLE_PX * (len(heading) - 1))
    return strand.moved(path[0] - strand.points[len(behind) - 1])


def _leaving(rng: np.random.Generator, side: float, bend: float, table: Table) -> FloatArray:
    """Return the change of heading (n,) of a cable that turns away to a side, from a curvature `bend` on."""
    length = 0.4 * table.length(rng)
    along = _even(length)
    arc = along * length
    fade = 30.0 * table.scale
    turn = side * rng.uniform(0.5, 1.1) * smoothstep(arc / (rng.uniform(90.0, 150.0) * table.scale))
    wander = rng.uniform(-0.6, 0.6) * (1.0 - np.cos(math.pi * along)) + rng.uniform(-0.4, 0.4) * (
        1.0 - np.cos(2.0 * math.pi * along)
    )
    return bend * fade * (1.0 - np.exp(-arc / fade)) + turn + wander


def _even(length_px: float) -> FloatArray:
    """Return normalised arc lengths (n,), half a pixel apart."""
    return np.linspace(0.0, 1.0, max(16, math.ceil(length_px / _SAMPLE_PX) + 1))
