"""The suites: sequences with known curves, by name."""

from __future__ import annotations

import hashlib
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from dloftbs.errors import InputError, SourceError
from dloftbs.sources import synthetic
from dloftbs.sources.base import KnownSequence
from dloftbs.sources.recorded import open_labelled

HD = (720, 1280)
QUICK_SCALE = 0.1
QUICK_SIZE = (360, 640)

Size = tuple[int, int]
Generator = Callable[[float, int, Size], Sequence[KnownSequence]]


@dataclass(frozen=True, eq=False)
class Suite:
    """Sequences that are scored together.

    Parameters
    ----------
    name : str
    title : str
        What it holds, in a line.
    sequences : tuple of KnownSequence
        Each can be pickled.
    settings : str
        What the frames depend on, besides the name: the same settings give the same frames.
    """

    name: str
    title: str
    sequences: tuple[KnownSequence, ...]
    settings: str

    @property
    def frames(self) -> int:
        """How many there are in all sequences."""
        return sum(len(sequence) for sequence in self.sequences)


_GENERATED: dict[str, tuple[str, Generator]] = {
    "rgbd-artificial": (
        "a cable in space, perfect depth: high curvature, self-intersection, rapid moves",
        lambda scale, seed, size: synthetic.rgbd_artificial(scale, seed=seed, size=size),
    ),
    "rgbd-noisy": (
        "the same by time-of-flight and stereo cameras, near and far: sigma 1.2 to 3.8 mm, holes, flying pixels",
        lambda scale, seed, size: synthetic.rgbd_noisy(scale, seed=seed, size=size),
    ),
    "rgb": (
        "a cable held by two grippers: thick, thin, occluded, out of the image, crossing itself",
        lambda scale, seed, size: synthetic.rgb(scale, seed=seed, size=size),
    ),
    "rgbd": (
        "a cable in hands, depth as a sensor gives it",
        lambda scale, seed, size: synthetic.rgbd_manipulation(scale, seed=seed, size=size),
    ),
    "several-cables": (
        "single images of 2 to 8 cables, masks as a network leaves them",
        lambda scale, seed, size: synthetic.several_cables(scale, seed=seed, size=size),
    ),
    "kinds": (
        "one kind of difficulty at a time, clean, noisy and occluded",
        lambda scale, seed, size: synthetic.kinds(scale, seed=seed, size=size),
    ),
    "tracking": (
        "cables that cross, hide, touch, leave the image and come back, 60 frames a sequence",
        lambda scale, seed, size: synthetic.tracking(scale, seed=seed, size=size),
    ),
    "plain-sight": (
        "cables in perspective that bend, tilt, come nearer, swing, come and go, cross; nothing hidden; 80 frames each",
        lambda scale, seed, size: synthetic.plain_sight(scale, seed=seed, size=size),
    ),
    "noise": (
        "ladders of growing noise",
        lambda scale, seed, size: synthetic.noise_ladder(scale, seed=seed, size=size),
    ),
}
SUITES = tuple(_GENERATED)
"""The names of the generated suites."""


def open_suite(name: str, *, scale: float = 1.0, seed: int = 0, size: Size = HD) -> Suite:
    """Open a suite.

    Parameters
    ----------
    name : str
        One of `SUITES`, or a folder: a labelled sequence, or one that holds such folders.
    scale : float
        Of the number of frames, against the paper's data sets; a folder is taken as it is.
    seed : int
        Of what is generated.
    size : (int, int)
        ``(H, W)`` px of what is generated.

    Raises
    ------
    InputError
        If there is no such suite, or a value is out of range.
    SourceError
        If the folder has no labelled sequence.
    """
    if name not in _GENERATED:
        return _open_folder(name)
    if not (0.0 < scale < math.inf) or seed < 0:
        raise InputError(f"expected scale > 0 and seed >= 0, got {scale} and {seed}")
    title, generator = _GENERATED[name]
    return Suite(name, title, tuple(generator(scale, seed, size)), f"scale {scale:g}, seed {seed}, {size[1]}x{size[0]}")


def _open_folder(name: str) -> Suite:
    folder = Path(name).expanduser()
    if not folder.is_dir():
        raise InputError(f"there is no suite and no folder {name!r}; the suites are {', '.join(SUITES)}")
    sequences = _sequences_in(folder)
    return Suite(folder.resolve().name, f"labelled data in {name}", tuple(sequences), f"files {_digest(folder)}")


def _sequences_in(folder: Path) -> list[KnownSequence]:
    try:
        return [_open(folder)]
    except SourceError:
        inside = [_open(place) for place in sorted(folder.iterdir()) if place.is_dir() and _opens(place)]
        if inside:
            return inside
        raise


def _open(folder: Path) -> KnownSequence:
    sequence = open_labelled(folder)
    sequence.name = folder.resolve().name
    return sequence


def _opens(folder: Path) -> bool:
    try:
        open_labelled(folder).close()
    except SourceError:
        return False
    return True


def _digest(folder: Path) -> str:
    """Return what changes when a file in the folder does."""
    files = [(str(path), path.stat()) for path in sorted(folder.resolve().rglob("*")) if path.is_file()]
    text = "\n".join(f"{path} {stat.st_size} {stat.st_mtime_ns}" for path, stat in files)
    return hashlib.sha256(text.encode()).hexdigest()[:12]
