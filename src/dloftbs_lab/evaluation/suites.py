"""The suites: sequences with known curves, by name."""

from __future__ import annotations

import hashlib
import math
import os
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from dloftbs.errors import InputError
from dloftbs.support.text import readable
from dloftbs_lab import synthetic
from dloftbs_lab.known_sequence import KnownSequence
from dloftbs_lab.recorded import LAYOUTS, looks_labelled, open_labelled
from dloftbs_lab.synthetic import Excerpt

HD = (720, 1280)
QUICK_SCALE = 0.1
QUICK_SIZE = (360, 640)
_SEEDS_APART = 1000
"""Of the seeds of two runs, and of the first from 0: the weights of linking were fitted on seeds below that."""
_FEWEST_FRAMES = 2
_RUNG_SCALE = 0.2
"""Of the frames of a rung: two for each seed."""

REAL_MOTION = "real-motion"
TWO_CAMERAS = "two-cameras"
"""The suite that is made from recordings, which no one but their authors may hand on."""
_RECORDINGS = Path("..", "shared", "data", "motion")
"""Folder of the recordings where none is named: beside the checkout, as photographs are for ``make results``."""

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


@dataclass(frozen=True)
class _Recipe:
    """Recipe of a generated suite.

    Parameters
    ----------
    title : str
    generator : callable
        Scale, seed and size to the sequences of one seed.
    scenes : int, optional
        Number of seeds at scale 1; None where the generator draws as many scenes as it is asked for, by the scale.
    frames : int
        Of each sequence at most, where there are several seeds: an excerpt, at the speed of the whole, from another
        part of the motion for each seed.
    in_common : bool
        Whether sequences of a seed whose names are equal up to the first comma show the same scene.
    files : Path, optional
        Folder that they are made from.
    """

    title: str
    generator: Generator
    scenes: int | None = None
    frames: int = 0
    in_common: bool = False
    files: Path | None = None


def _of_recordings(folder: Path) -> _Recipe:
    return _Recipe(
        "real cables' recorded motion, one to four before a camera at any side; occluders, depth, image; 5 s each",
        lambda scale, seed, size: synthetic.real_motion(folder, scale, seed, size),
        files=folder,
    )


_GENERATED: dict[str, _Recipe] = {
    "rgbd-artificial": _Recipe(
        "a cable in space, perfect depth: high curvature, self-intersection, rapid moves",
        synthetic.rgbd_artificial,
        scenes=8,
        frames=35,
    ),
    "rgbd-noisy": _Recipe(
        "the same by time-of-flight and stereo cameras, near and far: sigma 1.2 to 3.8 mm, holes, flying pixels",
        lambda scale, seed, size: synthetic.rgbd_noisy(4.0 * scale, seed, size),
        scenes=20,
        frames=4,
        in_common=True,
    ),
    "rgbd-camera": _Recipe(
        "cables of 3 to 20 mm above a table, single frames, each error of a depth camera by itself and all together",
        synthetic.rgbd_camera,
        in_common=True,
    ),
    "rgb": _Recipe(
        "a cable held by two grippers: thick, thin, occluded, out of the image, crossing itself",
        synthetic.rgb,
        scenes=20,
        frames=7,
    ),
    "rgbd": _Recipe("a cable in hands, depth as a sensor gives it", synthetic.rgbd_manipulation, scenes=8, frames=32),
    "several-cables": _Recipe(
        "single images of 2 to 8 cables, masks as a network leaves them", synthetic.several_cables
    ),
    "kinds": _Recipe(
        "one kind of difficulty at a time, clean, noisy and occluded",
        synthetic.kinds,
        scenes=20,
        frames=12,
        in_common=True,
    ),
    "tracking": _Recipe(
        "cables that cross, hide, touch, leave the image and come back, 60 frames a sequence", synthetic.tracking
    ),
    "known-occluders": _Recipe(
        "sequences of tracking with one or three cables and occluders, told by a mask and by a camera's depth",
        synthetic.known_occluders,
    ),
    "seen-occluders": _Recipe(
        "the same sequences with an image of the workbench, in which the occluders are seen",
        lambda scale, seed, size: synthetic.known_occluders(scale, seed, size, ["image"]),
    ),
    "plain-sight": _Recipe(
        "cables in perspective that bend, tilt, come nearer, swing, come and go, cross; nothing hidden; 80 frames each",
        synthetic.plain_sight,
    ),
    "edge-cases": _Recipe(
        "drawn images: sharp bends, facing ends, T and Y, cables side by side, cut by the border, a crossed ring",
        synthetic.edge_cases,
    ),
    "real-footage": _Recipe(
        "drawn faults of real footage: codecs, highlights, pin-holes, dashes, specks, ragged edges, coils, two colours",
        synthetic.real_footage,
    ),
    "simulated": _Recipe(
        "a cable that MuJoCo moves, in perspective: hanging, bending, twisting, buckling, snapping back, tangling",
        synthetic.simulated,
    ),
    "harness": _Recipe(
        "wiring harnesses that bend, drawn and in perspective: 2 to 6 branches, clean, noisy and occluded",
        synthetic.harnesses,
        scenes=20,
        frames=6,
        in_common=True,
    ),
    TWO_CAMERAS: _Recipe(
        "cables that sway before two cameras, masks alone: rigs known exactly, wrong by 0.1 degree, 5 ms out of step",
        synthetic.two_cameras,
    ),
    REAL_MOTION: _of_recordings(_RECORDINGS),
    "noise": _Recipe(
        "ladders of growing noise",
        lambda scale, seed, size: synthetic.noise_ladder(_RUNG_SCALE * scale, seed, size),
        scenes=20,
        frames=2,
        in_common=True,
    ),
}
SUITES = tuple(_GENERATED)
"""The names of the generated suites."""


def missing_for(name: str) -> str | None:
    """Return what a suite needs that is not there, in words, or None."""
    recipe = _recipe_of(name)
    if recipe is not None and recipe.files is not None:
        return synthetic.missing_recordings(recipe.files)
    return synthetic.SIMULATION_REMEDY if name == "simulated" and not synthetic.simulation_available() else None


def open_suite(
    name: str, *, scale: float = 1.0, seed: int = 0, size: Size = HD, tolerance_px: float | None = None
) -> Suite:
    """Open a suite.

    Parameters
    ----------
    name : str
        One of `SUITES`, or a folder: a labelled sequence, or one that holds such folders. ``LAYOUT:FOLDER`` says which
        of `dloftbs_lab.recorded.LAYOUTS` it has, such as ``mbest:photographs``; ``real-motion:FOLDER`` says where
        the recordings are.
    scale : float
        Of the number of scenes, and so of frames: at 1 a generated suite has at least 20 of different seeds for each of
        its figures, but for those of a single scenario of rgbd and rgbd-artificial, which have 8. A folder is taken as
        it is.
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
    recipe = _recipe_of(name)
    suite = _open_folder(name) if recipe is None else _open_generated(name, recipe, scale, seed, size)
    if tolerance_px is None:
        return suite
    if not 0.0 < tolerance_px < math.inf:
        raise InputError(f"tolerance_px must be positive, got {tolerance_px}")
    for sequence in suite.sequences:
        sequence.tolerance_px = tolerance_px
    return replace(suite, settings=f"{suite.settings}, tolerance {tolerance_px:g} px")


def _recipe_of(name: str) -> _Recipe | None:
    """Return the recipe of a generated suite, or None for any other name."""
    return _of_recordings(place_of(name)) if name.startswith(f"{REAL_MOTION}:") else _GENERATED.get(name)


def _open_generated(name: str, recipe: _Recipe, scale: float, seed: int, size: Size) -> Suite:
    remedy = missing_for(name)
    if remedy is not None:
        raise InputError(remedy)
    if not (0.0 < scale < math.inf) or seed < 0:
        raise InputError(f"expected scale > 0 and seed >= 0, got {scale} and {seed}")
    if recipe.scenes is None:
        sequences = recipe.generator(scale, seed, size)
        for sequence in sequences:
            sequence.scene_name = _base_name(sequence, recipe.in_common)
    else:
        sequences = _excerpts(recipe, scale, seed, size)
    settings = f"scale {scale:g}, seed {seed}, {size[1]}x{size[0]}"
    if recipe.files is not None:
        settings += f", files {_digest(recipe.files)}"
        name = REAL_MOTION
    return Suite(name, recipe.title, tuple(sequences), settings, thinned=scale < 1.0)


def _excerpts(recipe: _Recipe, scale: float, seed: int, size: Size) -> list[KnownSequence]:
    """Return the sequences of as many seeds as the scale asks for; of less than one seed, fewer frames."""
    assert recipe.scenes is not None
    scenes = max(1, round(scale * recipe.scenes))
    frames = max(_FEWEST_FRAMES, round(min(1.0, scale * recipe.scenes) * recipe.frames))
    made: list[KnownSequence] = []
    for number in range(scenes):
        for whole in recipe.generator(1.0, _SEEDS_APART * (seed + 1) + number, size):
            length = min(frames, len(whole))
            start = round((len(whole) - length) * number / max(scenes - 1, 1))
            sequence = Excerpt(whole, start, length)
            sequence.scene_name = f"{_base_name(whole, recipe.in_common)}, seed {number}"
            made.append(sequence)
    return made


def _base_name(sequence: KnownSequence, in_common: bool) -> str:
    return sequence.name.partition(",")[0] if in_common else sequence.name


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
    """Return the folder of data that is named by its path, or as ``LAYOUT:PATH`` or ``real-motion:PATH``."""
    prefix = REAL_MOTION if name.startswith(f"{REAL_MOTION}:") else _layout_of(name)
    return Path(os.path.expanduser(name.removeprefix(f"{prefix}:")))


def _sequences_in(folder: Path, layout: str) -> list[KnownSequence]:
    inside = [path for path in sorted(folder.iterdir()) if os.path.isdir(path) and looks_labelled(path, layout)]
    of_one = looks_labelled(folder, layout) or not inside
    return [_open(path, layout) for path in ([folder] if of_one else inside)]


def _open(folder: Path, layout: str) -> KnownSequence:
    sequence = open_labelled(folder, layout)
    sequence.name = readable(folder.resolve().name)
    return sequence


def _digest(folder: Path) -> str:
    """Return what changes when a file in the folder does."""
    files = [(str(path), path.stat()) for path in sorted(folder.resolve().rglob("*")) if os.path.isfile(path)]
    text = "\n".join(f"{path} {stat.st_size} {stat.st_mtime_ns}" for path, stat in files)
    return hashlib.sha256(os.fsencode(text)).hexdigest()[:12]
