"""The suites: sequences with known curves, by name."""

from __future__ import annotations

import hashlib
import math
import os
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from dloftbs import synthetic
from dloftbs._text import readable
from dloftbs.errors import InputError, SourceError
from dloftbs.sources.recorded import LAYOUTS, open_labelled
from dloftbs.sources.source import KnownSequence

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
        Contents in a line.
    sequences : tuple of KnownSequence
        Each can be pickled.
    settings : str
        Settings that the frames depend on, besides the name: the same settings give the same frames.
    thinned : bool
        Whether there are fewer frames than the full suite has.
    """

    name: str
    title: str
    sequences: tuple[KnownSequence, ...]
    settings: str
    thinned: bool = False

    @property
    def frames(self) -> int:
        """Number of frames in all sequences."""
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
    "rgbd-camera": (
        "cables of 3 to 20 mm above a table, single frames, each error of a depth camera by itself and all together",
        lambda scale, seed, size: synthetic.rgbd_camera(scale, seed=seed, size=size),
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
    "known-occluders": (
        "the sequences of tracking with occluders, told by a mask and by depth with the errors of a camera",
        lambda scale, seed, size: synthetic.known_occluders(scale, seed=seed, size=size),
    ),
    "seen-occluders": (
        "the same sequences with an image of the workbench, in which the occluders are seen",
        lambda scale, seed, size: synthetic.known_occluders(scale, seed, size, ["image"]),
    ),
    "plain-sight": (
        "cables in perspective that bend, tilt, come nearer, swing, come and go, cross; nothing hidden; 80 frames each",
        lambda scale, seed, size: synthetic.plain_sight(scale, seed=seed, size=size),
    ),
    "edge-cases": (
        "drawn images: sharp bends, facing ends, T and Y, cables side by side, cut by the border, a crossed ring",
        lambda scale, seed, size: synthetic.edge_cases(scale, seed=seed, size=size),
    ),
    "simulated": (
        "a cable that MuJoCo moves, in perspective: hanging, bending, twisting, buckling, snapping back, tangling",
        lambda scale, seed, size: synthetic.simulated(scale, seed=seed, size=size),
    ),
    "noise": (
        "ladders of growing noise",
        lambda scale, seed, size: synthetic.noise_ladder(scale, seed=seed, size=size),
    ),
}
SUITES = tuple(_GENERATED)
"""The names of the generated suites."""


def missing_for(name: str) -> str | None:
    """Return what has to be installed for a suite, in words, or None."""
    return synthetic.SIMULATION_REMEDY if name == "simulated" and not synthetic.simulation_available() else None


def open_suite(
    name: str, *, scale: float = 1.0, seed: int = 0, size: Size = HD, tolerance_px: float | None = None
) -> Suite:
    """Open a suite.

    Parameters
    ----------
    name : str
        One of `SUITES`, or a folder: a labelled sequence, or one that holds such folders. ``LAYOUT:FOLDER`` says which
        of `dloftbs.sources.recorded.LAYOUTS` it has, such as ``mbest:photographs``.
    scale : float
        Of the number of frames, against the paper's data sets; a folder is taken as it is.
    seed : int
        Seed of the generated sequences.
    size : (int, int)
        ``(H, W)`` px of the generated sequences.
    tolerance_px : float, optional
        The largest L3 of a curve that counts as right, in place of what the sequences say.

    Raises
    ------
    InputError
        If there is no such suite, what it needs is not installed, or a value is out of range.
    SourceError
        If the folder has no labelled sequence.
    """
    suite = _open_generated(name, scale, seed, size) if name in _GENERATED else _open_folder(name)
    if tolerance_px is None:
        return suite
    if not 0.0 < tolerance_px < math.inf:
        raise InputError(f"tolerance_px must be positive, got {tolerance_px}")
    for sequence in suite.sequences:
        sequence.tolerance_px = tolerance_px
    return replace(suite, settings=f"{suite.settings}, tolerance {tolerance_px:g} px")


def _open_generated(name: str, scale: float, seed: int, size: Size) -> Suite:
    remedy = missing_for(name)
    if remedy is not None:
        raise InputError(remedy)
    if not (0.0 < scale < math.inf) or seed < 0:
        raise InputError(f"expected scale > 0 and seed >= 0, got {scale} and {seed}")
    title, generator = _GENERATED[name]
    settings = f"scale {scale:g}, seed {seed}, {size[1]}x{size[0]}"
    return Suite(name, title, tuple(generator(scale, seed, size)), settings, thinned=scale < 1.0)


def _open_folder(name: str) -> Suite:
    layout, folder = _layout_of(name), place_of(name)
    if not os.path.isdir(folder):
        raise InputError(f"there is no suite and no folder {str(folder)!r}; the suites are {', '.join(SUITES)}")
    sequences = _sequences_in(folder, layout)
    return Suite(
        readable(folder.resolve().name),
        f"labelled data in {readable(str(folder))}",
        tuple(sequences),
        f"files {_digest(folder)}" + ("" if layout == "auto" else f", layout {layout}"),
    )


def _layout_of(name: str) -> str:
    layout, colon, _ = name.partition(":")
    return layout if colon and layout in LAYOUTS else "auto"


def place_of(name: str) -> Path:
    """Return the folder of labelled data that is named by its path, or as ``LAYOUT:PATH``."""
    layout = _layout_of(name)
    return Path(os.path.expanduser(name if layout == "auto" else name.removeprefix(f"{layout}:")))


def _sequences_in(folder: Path, layout: str) -> list[KnownSequence]:
    try:
        return [_open(folder, layout)]
    except SourceError:
        inside = [_open(p, layout) for p in sorted(folder.iterdir()) if p.is_dir() and _opens(p, layout)]
        if inside:
            return inside
        raise


def _open(folder: Path, layout: str) -> KnownSequence:
    sequence = open_labelled(folder, layout)
    sequence.name = readable(folder.resolve().name)
    return sequence


def _opens(folder: Path, layout: str) -> bool:
    try:
        open_labelled(folder, layout).close()
    except SourceError:
        return False
    return True


def _digest(folder: Path) -> str:
    """Return what changes when a file in the folder does."""
    files = [(str(path), path.stat()) for path in sorted(folder.resolve().rglob("*")) if path.is_file()]
    text = "\n".join(f"{path} {stat.st_size} {stat.st_mtime_ns}" for path, stat in files)
    return hashlib.sha256(text.encode()).hexdigest()[:12]
