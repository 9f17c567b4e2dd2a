"""Masks made worse, reproducibly: noise, ragged edges, gaps, occluders and false positives of stated strength."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from dloftbs.data.curve import BSplineCurve
from dloftbs.data.frame import Frame
from dloftbs.errors import InputError
from dloftbs.support.arrays import FloatArray
from dloftbs_lab.known_sequence import KnownSequence
from dloftbs_lab.synthetic import blemishes
from dloftbs_lab.synthetic.fault_ranges import Faults, Mask, check_amounts, check_lengths, check_ranges
from dloftbs_lab.synthetic.occluder_limits import leaves_enough
from dloftbs_lab.truth import Truth

# Each effect has random numbers of its own: more of one leaves the others as they are.
_GAPS, _DISCS, _STROKES, _SPECKS, _PINHOLES, _JITTER, _SALT = range(7)
_ATTEMPTS = 100  # where discs cannot leave enough to be seen, the last ones are taken


def _rng(key: Sequence[int], effect: int) -> np.random.Generator:
    return np.random.default_rng([*key, effect])


@dataclass(frozen=True)
class Degradation(Faults):
    """Degradation of a mask; the defaults leave it as it is. Ranges are ``(low, high)``, drawn from evenly.

    Parameters
    ----------
    salt_and_pepper : float
        Share of all pixels that become their opposite, in 0..1.
    jitter_px : float
        Standard deviation by which the border moves in and out.
    jitter_correlation_px : float
        Distance over which the correlation of that movement falls to 1 / e.
    missing : float
        Share of the cables' length, taken together, that is cut out by discs centred on them, in 0..0.9.
    missing_radius_px : (float, float)
        Of these discs; they are scaled to cut out the exact share.
    discs : int
        Number of occluding discs centred anywhere on the cables, but where they would hide an end, or more of a
        cable than its course can be known from: see `leaves_enough`.
    disc_radius_px : (float, float)
    specks, pinholes : int
        Number of small blobs of foreground anywhere, and of background on the cables.
    speck_radius_px, pinhole_radius_px : (float, float)
    false_positives : int
        Number of short stray strokes.
    stroke_length_px, stroke_width_px : (float, float)
    name : str
        For the names of sequences.

    Raises
    ------
    InputError
        If a value is out of range.
    """

    salt_and_pepper: float = 0.0
    jitter_px: float = 0.0
    jitter_correlation_px: float = 2.0
    missing: float = 0.0
    missing_radius_px: tuple[float, float] = (12.0, 24.0)
    discs: int = 0
    disc_radius_px: tuple[float, float] = (18.0, 34.0)
    specks: int = 0
    speck_radius_px: tuple[float, float] = (1.0, 4.0)
    pinholes: int = 0
    pinhole_radius_px: tuple[float, float] = (0.8, 2.5)
    false_positives: int = 0
    stroke_length_px: tuple[float, float] = (20.0, 80.0)
    stroke_width_px: tuple[float, float] = (4.0, 10.0)
    name: str = "degraded"

    _LENGTHS = ("jitter_px", "jitter_correlation_px")
    _RANGES = (
        "missing_radius_px",
        "disc_radius_px",
        "speck_radius_px",
        "pinhole_radius_px",
        "stroke_length_px",
        "stroke_width_px",
    )

    def __post_init__(self) -> None:
        check_amounts(self, ("salt_and_pepper",), 1.0)
        check_amounts(self, ("missing",), 0.9)
        check_amounts(self, ("jitter_px", "discs", "specks", "pinholes", "false_positives"))
        check_lengths(self, ("jitter_correlation_px",))
        check_ranges(self, self._RANGES)

    @property
    def hides(self) -> bool:
        """Whether there are gaps or occluders."""
        return self.missing > 0.0 or self.discs > 0

    def hidden(self, curves: Sequence[BSplineCurve], size: tuple[int, int], key: Sequence[int]) -> Mask:
        """Return what gaps and occluders hide, shape (H, W)."""
        covered = np.zeros(size, bool)
        if self.missing and curves:
            rng = _rng(key, _GAPS)
            blemishes.draw_discs(
                covered, *blemishes.gaps_along(curves, self.missing, self.missing_radius_px, rng), True
            )
        if self.discs and curves:
            blemishes.draw_discs(covered, *self._occluders(curves, _rng(key, _DISCS)), True)
        return covered

    def _occluders(self, curves: Sequence[BSplineCurve], rng: np.random.Generator) -> tuple[FloatArray, FloatArray]:
        """Return the centres (n, 2) and radii (n,) of discs, px."""
        for _ in range(_ATTEMPTS):
            radii = rng.uniform(*self.disc_radius_px, self.discs)
            centres = blemishes.spots_on(curves, radii, rng)
            if leaves_enough(curves, centres, radii, self.disc_radius_px[0]):
                break
        return centres, radii

    def _spoil(self, seen: Mask, curves: Sequence[BSplineCurve], key: Sequence[int]) -> Mask:
        self._blot(seen, key)
        if self.jitter_px:
            seen = blemishes.jitter_edges(seen, self.jitter_px, self.jitter_correlation_px, _rng(key, _JITTER))
        if self.salt_and_pepper:
            blemishes.flip_pixels(seen, self.salt_and_pepper, _rng(key, _SALT))
        return seen

    def _blot(self, seen: Mask, key: Sequence[int]) -> None:
        """Draw pinholes, stray strokes and specks into `seen` (H, W)."""
        cable = np.flatnonzero(seen) if self.pinholes else np.zeros(0, np.intp)
        if len(cable):
            rng = _rng(key, _PINHOLES)
            rows, columns = np.divmod(rng.choice(cable, self.pinholes), seen.shape[1])
            spots = np.stack((columns, rows), axis=1).astype(np.float64)
            blemishes.draw_blobs(seen, spots, self.pinhole_radius_px, False, rng)
        rng = _rng(key, _STROKES)
        for _ in range(self.false_positives):
            blemishes.draw_stroke(seen, self.stroke_length_px, self.stroke_width_px, rng)
        rng = _rng(key, _SPECKS)
        spots = rng.uniform((0.0, 0.0), seen.shape[::-1], (self.specks, 2))
        blemishes.draw_blobs(seen, spots, self.speck_radius_px, True, rng)


NOISY = Degradation(salt_and_pepper=0.003, jitter_px=1.0, jitter_correlation_px=2.0, name="noisy")
"""Salt-and-pepper of 0.3 % and an edge jitter of 1 px that is correlated over 2 px."""

OCCLUDED = Degradation(discs=3, name="occluded")
"""Three discs of radius 18 to 34 px on the cables."""


class DegradedSequence(KnownSequence):
    """A sequence with its masks made worse. The true curves stay; what gaps and occluders hide is no longer visible.

    Frames are those of the sequence with the degraded mask, and without the image, which would not show what happened
    to the mask. Where they have no mask, the true one is taken.

    Parameters
    ----------
    sequence : KnownSequence
    degradation : Faults
    seed : int
        Not negative; with the index it decides what happens to a frame.
    name : str, optional
        ``"<sequence>, <degradation>"`` where it is left out.

    Raises
    ------
    InputError
        If the seed is negative.
    """

    def __init__(self, sequence: KnownSequence, degradation: Faults, seed: int = 0, name: str | None = None) -> None:
        if seed < 0:
            raise InputError(f"seed must not be negative, got {seed}")
        self.name = f"{sequence.name}, {degradation.name}" if name is None else name
        self.fps = sequence.fps
        self.length = sequence.length
        self.is_branched = sequence.is_branched
        self.folder = sequence.folder
        self.sequence = sequence
        self.degradation = degradation
        self.seed = seed

    def frame(self, index: int) -> Frame:
        """Return one frame with the degraded mask, shape (H, W) bool.

        Raises
        ------
        InputError
            If there is no such frame, or neither it nor its truth has a mask.
        """
        frame, truth = self.sequence.frame(index), self.sequence.truth(index)
        mask = truth.mask if frame.mask is None else frame.is_cable
        if mask is None:
            raise InputError(f"{self.sequence.name} has no masks to degrade")
        degraded = self.degradation.apply(mask, truth.curves, (self.seed, index))
        return replace(frame, image=None, mask=degraded, mask_is="binary", name=f"{self.name}#{index:04d}")

    def truth(self, index: int) -> Truth:
        """Return the truth of a frame.

        Raises
        ------
        InputError
            If there is no such frame.
        """
        truth = self.sequence.truth(index)
        if not truth.visible_masks or not self.degradation.hides:
            return truth
        size = truth.visible_masks[0].shape
        seen = ~self.degradation.hidden(truth.curves, (size[0], size[1]), (self.seed, index))
        return replace(truth, visible_masks=tuple(mask & seen for mask in truth.visible_masks))
