"""Ladders: the same few frames with one difficulty that grows from rung to rung, for plots of error against it."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace

from dloftbs.errors import InputError
from dloftbs_lab.known_sequence import KnownSequence
from dloftbs_lab.synthetic.cables import TangleSequence
from dloftbs_lab.synthetic.degrade import Degradation, DegradedSequence
from dloftbs_lab.synthetic.depth_noise import TYPICAL_NOISE, DepthNoise
from dloftbs_lab.synthetic.generated import count_at, proportion
from dloftbs_lab.synthetic.rgb import RgbSequence
from dloftbs_lab.synthetic.rgbd_suites import rgbd_artificial, rgbd_manipulation

Size = tuple[int, int]

_FRAMES = 10
_SALT_PERCENT = (0.0, 0.1, 0.3, 0.5, 1.0, 2.0)
_JITTER_PX = (0.0, 0.5, 1.0, 2.0)
_MISSING_PERCENT = (0.0, 5.0, 10.0, 20.0)
_WIDTHS_PX = (2.0, 4.0, 8.0, 12.0, 20.0, 40.0)
_DEPTH_NOISE = (0.0, 0.5, 1.0, 2.0, 4.0)
_DEPTH_HOLES_PERCENT = (0.0, 5.0, 10.0, 20.0, 40.0)
_DEPTH_FLYING_PERCENT = (0.0, 25.0, 50.0, 100.0)
_DEPTH_GRAIN_PX = (0.0, 1.0, 2.0, 4.0, 8.0)
_SIZES = ((240, 320), (480, 640), (720, 1280), (1080, 1920), (2160, 3840))


@dataclass(frozen=True)
class LadderBase:
    """Sequence that a ladder makes harder.

    Parameters
    ----------
    make : callable
        Frames, size and seed to a sequence.
    make_wide : callable, optional
        Frames, size, seed and the cable's width in px to a sequence with the same motion; without it there is no ladder
        of widths.
    make_noisy : callable, optional
        Frames, size, seed and the noise of its depth to a sequence with the same motion; without it there are no
        ladders of depth.
    """

    make: Callable[[int, Size, int], KnownSequence]
    make_wide: Callable[[int, Size, int, float], KnownSequence] | None = None
    make_noisy: Callable[[int, Size, int, DepthNoise], KnownSequence] | None = None


_BASES = {
    "rgb": LadderBase(
        lambda frames, size, seed: RgbSequence("plain", frames, size, seed),
        lambda frames, size, seed, width_px: RgbSequence("plain", frames, size, seed, width_px),
    ),
    "several cables": LadderBase(
        lambda frames, size, seed: TangleSequence(3, frames, size, seed),
        lambda frames, size, seed, width_px: TangleSequence(3, frames, size, seed, width_px),
    ),
    "rgbd artificial": LadderBase(
        lambda frames, size, seed: rgbd_artificial(frames / 280, seed, size)[0],
        make_noisy=lambda frames, size, seed, noise: rgbd_artificial(frames / 280, seed, size, noise)[0],
    ),
    "rgbd": LadderBase(lambda frames, size, seed: rgbd_manipulation(frames / 250, seed, size)[0]),
}

LADDER_BASES = tuple(_BASES)
"""Names that `noise_ladder` takes: a scenario of each suite."""


class Rung(DegradedSequence):
    """A sequence on a ladder.

    Parameters
    ----------
    sequence : KnownSequence
    degradation : Degradation
    seed : int
        Not negative.
    base : str
        Name of the sequence that the ladder makes harder.
    ladder : str
        Quantity that grows: ``"salt and pepper"``, ``"edge jitter"``, ``"missing stretches"``, ``"width"``, ``"size"``,
        or one that begins with ``"depth"``.
    level : float
        Amount of it, in `unit`.
    unit : str
        ``"%"``, ``"px"`` or ``"sigma"``, multiples of `depth_sigma`; of sizes, px is the width of the image.
    """

    def __init__(
        self,
        sequence: KnownSequence,
        degradation: Degradation,
        seed: int,
        base: str,
        ladder: str,
        level: float,
        unit: str,
    ) -> None:
        super().__init__(sequence, degradation, seed, f"{base}, {ladder} {level:g} {unit}")
        self.base = base
        self.ladder = ladder
        self.level = level
        self.unit = unit


def noise_ladder(
    scale: float = 1.0,
    seed: int = 0,
    size: Size = (720, 1280),
    *,
    bases: Sequence[str] | dict[str, LadderBase] = LADDER_BASES,
) -> list[Rung]:
    """Return ladders of salt-and-pepper, edge jitter, missing stretches, widths, depth and image sizes.

    Those of depth let one of noise, holes, flying pixels and grain grow, and leave the others as `TYPICAL_NOISE` has
    them. A rung has 10 frames by the scale, at least 2.

    All rungs of a base show the same motion, but that several cables lie as their width and the image allow. Lengths
    in px are those in an image of 1280 x 720 and go in proportion with `size`, which does not concern the ladder of
    sizes.

    The `bases` are the sequences to make harder: some of `LADDER_BASES`, or factories by name.
    """
    frames = count_at(scale, _FRAMES, 2)
    found = bases if isinstance(bases, dict) else {name: _base(name) for name in bases}
    return [rung for name, base in found.items() for rung in _rungs(name, base, frames, size, seed)]


def _base(name: str) -> LadderBase:
    if name not in _BASES:
        raise InputError(f"bases must be some of {', '.join(map(repr, LADDER_BASES))}, got {name!r}")
    return _BASES[name]


def _rungs(name: str, base: LadderBase, frames: int, size: Size, seed: int) -> Iterator[Rung]:
    sequence = base.make(frames, size, seed)
    k = proportion(size)
    for level in _SALT_PERCENT:
        yield Rung(sequence, Degradation(salt_and_pepper=level / 100.0), seed, name, "salt and pepper", level, "%")
    for level in _JITTER_PX:
        worse = Degradation(jitter_px=level).scaled(k)
        yield Rung(sequence, worse, seed, name, "edge jitter", level, "px")
    for level in _MISSING_PERCENT:
        worse = Degradation(missing=level / 100.0).scaled(k)
        yield Rung(sequence, worse, seed, name, "missing stretches", level, "%")
    if base.make_wide is not None:
        for level in _WIDTHS_PX:
            wide = base.make_wide(frames, size, seed, max(1.0, level * k))
            yield Rung(wide, Degradation(), seed, name, "width", level, "px")
    if base.make_noisy is not None:
        for ladder, level, unit, noise in _depth_steps(k):
            noisy = base.make_noisy(frames, size, seed, noise)
            yield Rung(noisy, Degradation(), seed, name, ladder, level, unit)
    for shape in _SIZES:
        yield Rung(base.make(frames, shape, seed), Degradation(), seed, name, "size", float(shape[1]), "px")


def _depth_steps(k: float) -> Iterator[tuple[str, float, str, DepthNoise]]:
    """Yield ladder, level, unit and noise, px being those of an image `k` times as large as HD."""
    for level in _DEPTH_NOISE:
        yield "depth noise", level, "sigma", replace(TYPICAL_NOISE, depth_noise=level)
    for level in _DEPTH_HOLES_PERCENT:
        yield "depth holes", level, "%", replace(TYPICAL_NOISE, hole_share=level / 100.0)
    for level in _DEPTH_FLYING_PERCENT:
        yield "depth flying pixels", level, "%", replace(TYPICAL_NOISE, flying=level / 100.0)
    for level in _DEPTH_GRAIN_PX:
        yield "depth grain", level, "px", replace(TYPICAL_NOISE, grain_px=level * k)
