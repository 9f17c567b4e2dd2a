"""Scenes whose true joints are known, from sources that differ."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from itertools import chain
from pathlib import Path
from typing import Literal

import cv2
import numpy as np
import numpy.typing as npt

from dloftbs import Frame
from dloftbs_lab import KnownSequence, synthetic
from dloftbs_lab.truth import Truth

SOURCES = {
    "generated": "cables of the kinds and of tracking sequences, noisy, from 5 px on; two that touch, in poor depth",
    "covered": "one and three cables of the kinds behind discs, the mask alone",
    "hidden": "one, three and five cables behind moving discs and bars, with mask, image, depth and occluders",
    "simulated": "a cable moved by MuJoCo, in perspective",
    "recorded": "one to three real cables' recorded motion, with depth or an image, behind moving discs or not",
    "drawn": "edge cases: sharp bends, ends that face each other, T, Y, cables side by side, crossed rings, near frays",
    "broken": "drawn cables whose masks are broken in places, and ends of two that are as near to each other",
    "photographs": "of cables, with points along each or labelled pixels; nothing of them is kept",
    "masks": "of single cables in photographs, by the authors of DLOFTBs, with gaps; nothing of them is kept",
}

GAP_SOURCES = {
    "masks": SOURCES["masks"],
    "networks": "masks of cables on wood, tiles and tools, by two networks; labelled pixels; nothing of them is kept",
    "dashes": "masks of power lines by a network, in dashes; every gap is right; nothing of them is kept",
    "worms": "masks of a worm beside specks; no gap is right; nothing of them is kept",
    "specks": "a drawn worm beside specks",
}
"""Sources that the confidence of gaps is fitted to: no other ones have debris, dashes and stubs."""

FIXED = ("photographs", "masks", "networks", "dashes", "worms")
"""Sources that are the same with every seed."""

_POINTS_OFF_PX = 6.0  # of points that a person clicked along a cable
_BROKEN = ("broken", "ends near each other", "broken, picture", "close ends, picture")
_UNREADABLE = "close ends, picture"
"""Whose masks, alone, are those of broken ones."""
_HALF_GREY = 128  # of a network's output: a probability of one half
_SMALL = (128, 160)
_HALF, _FULL = (360, 640), (720, 1280)
_ALL: tuple[Literal["occluders", "depth", "image"], ...] = ("occluders", "depth", "image")

Points = npt.NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Scene:
    """A frame and its true cables: curves, as points about 1 px apart, or an image of labels."""

    source: str
    frame: Frame
    curves: tuple[Points, ...] = ()
    truth: Truth | None = None
    labels: npt.NDArray[np.uint8] | None = None
    off_px: float = 0.0


def list_scenes(source: str, seed: int, amount: float, photographs: Path, *, whole: bool = False) -> Iterator[Scene]:
    """Yield the scenes of one source, and these again with less evidence, but for those that are asked for as a whole.

    Photographs and masks are the same with every seed.

    Raises
    ------
    SystemExit
        If there are none.
    """
    if source in FIXED:
        found = list(_FIXED_SCENES[source](photographs))
        if not found:
            raise SystemExit(f"{photographs} lacks {_FILES[source]}")
        yield from found
        return
    if source == "simulated" and not synthetic.simulation_available():
        raise SystemExit(f"no simulator: {synthetic.SIMULATION_REMEDY}")
    for sequence, step in _sequences(source, seed, amount, photographs / "motion"):
        for index in range(0, len(sequence), step):
            truth = sequence.truth(index)
            if truth.curves:
                scene = of_truth(source, sequence.frame(index), truth)
                yield from [scene] if whole or sequence.name == _UNREADABLE else _with_less(scene)


def of_truth(source: str, frame: Frame, truth: Truth) -> Scene:
    """Return a scene of a frame whose truth is known."""
    return Scene(source, frame, tuple(curve.sample(max(int(curve.length), 20)) for curve in truth.curves), truth)


def _sequences(source: str, seed: int, amount: float, recordings: Path) -> Iterator[tuple[KnownSequence, int]]:
    """Yield sequences and the step from one of their frames to the next that counts."""
    many = max(round(6 * amount), 1)
    if source == "recorded":
        missing = synthetic.missing_recordings(recordings)
        if missing is not None:
            raise SystemExit(missing)
        yield from (
            (synthetic.RealMotionSequence(recordings, cables, variant, number, seed=seed), 10)
            for variant in ("depth", "occluders and depth", "occluders and image")
            for cables in (1, 2, 3)
            for number in range(max(many // 2, 1))
        )
    elif source == "specks":
        for number in range(2 * many):
            yield synthetic.RealFootageSequence("specks", number, size=_SMALL, seed=seed), 4
    elif source == "drawn":
        yield from ((one, 1) for one in synthetic.edge_cases(amount, seed=seed) if one.name not in _BROKEN)
    elif source == "broken":
        for kind in _BROKEN:
            yield synthetic.EdgeCaseSequence(kind, max(round(100 * amount), 1), seed=seed), 1
    elif source == "covered":
        for size in (_HALF, _FULL):
            covered = [one for one in synthetic.kinds(0.5 * amount, seed=seed, size=size) if "occluded" in one.name]
            yield from ((sequence, 5) for sequence in covered)
    elif source == "simulated":
        for number in range(many):
            for sequence in synthetic.simulated(0.02, seed=seed + number):
                yield sequence, 2
    elif source == "generated":
        for size in (_HALF, _FULL):
            plain = [one for one in synthetic.kinds(0.15 * amount, seed=seed, size=size) if "occluded" not in one.name]
            yield from ((sequence, 7) for sequence in plain)
            yield from (
                (synthetic.TrackingSequence("crossing", cables, number, size=size, seed=seed, evidence=_ALL), 23)
                for cables in (1, 3, 5)
                for number in range(many)
            )
        yield from ((sequence, 5) for sequence in synthetic.several_cables(0.5 * amount, seed=seed))
        yield synthetic.DepthCameraSequence("crossing", "all", 30 * many, seed=seed), 1
    else:
        yield from (
            (synthetic.TrackingSequence("occluded", cables, number, seed=seed, evidence=_ALL), 17)
            for cables in (1, 3, 5)
            for number in range(2 * many)
        )


def _with_less(scene: Scene) -> Iterator[Scene]:
    """Yield a scene with its mask alone, with its image, and with all that it has."""
    frame = scene.frame
    yield replace(scene, frame=Frame(mask=frame.mask))
    if frame.image is not None:
        yield replace(scene, frame=Frame(mask=frame.mask, image=frame.image))
    if frame.depth is not None:
        yield scene


def _with_points(folder: Path) -> Iterator[Scene]:
    for path in sorted(folder.glob("cables/*.txt")):
        rows = [np.array(line.split()[1:], float).reshape(-1, 2) for line in path.read_text().splitlines()]
        curves = tuple(_evenly(points) for points in rows if len(points) > 1)
        mask = cv2.imread(str(path.with_name(f"{path.stem}_mask_all.png")), cv2.IMREAD_GRAYSCALE)
        image = cv2.imread(str(path.with_suffix(".jpg")))
        assert mask is not None
        frame = Frame(mask=mask > 0, image=np.asarray(image, np.uint8))
        yield from _with_less(Scene("photographs", frame, curves, off_px=_POINTS_OFF_PX))


def _with_labels(folder: Path) -> Iterator[Scene]:
    for path in sorted(folder.glob("mbest/*/*.labels.png")):
        labels = np.asarray(cv2.imread(str(path), cv2.IMREAD_GRAYSCALE), np.uint8)
        image = cv2.imread(str(path.with_name(path.name.replace(".labels.png", ".jpg"))))
        frame = Frame(mask=labels > 0, image=np.asarray(image, np.uint8))
        yield from _with_less(Scene("photographs", frame, labels=labels))


def _with_curve(folder: Path) -> list[Scene]:
    """Return masks of one cable each, with the curve that the authors' program finds in it."""
    found: list[Scene] = []
    known = folder / "masks" / "original_curves.json"
    for name, points in json.loads(known.read_text()).items() if known.exists() else ():
        mask = cv2.imread(str(folder / "masks" / name), cv2.IMREAD_GRAYSCALE)
        assert mask is not None
        curves = (_evenly(np.array(points, float)),)
        found.append(Scene("masks", Frame(mask=mask > 0), curves, off_px=_POINTS_OFF_PX))
    return found


def _of_networks(folder: Path) -> Iterator[Scene]:
    for path in sorted(folder.glob("networks/ewd/*.labels.png")):
        labels = np.asarray(cv2.imread(str(path), cv2.IMREAD_GRAYSCALE), np.uint8)
        stem = path.name.removesuffix(".labels.png")
        image = np.asarray(cv2.imread(str(path.with_name(f"{stem}.jpg"))), np.uint8)
        for network in ("r101", "r50"):
            grey = np.asarray(cv2.imread(str(path.with_name(f"{stem}.{network}.png")), cv2.IMREAD_GRAYSCALE))
            yield from _with_less(Scene("networks", Frame(mask=grey >= _HALF_GREY, image=image), labels=labels))


def _of_cases(folder: Path, case: str, source: str) -> Iterator[Scene]:
    """Yield the masks of a case: dashes are all of one label, and of a worm and specks each piece has its own."""
    for path in sorted(folder.glob(f"cases/{case}/*.png")):
        mask = np.asarray(cv2.imread(str(path), cv2.IMREAD_GRAYSCALE)) > 0
        labels = np.ones(mask.shape, np.uint8)
        if source == "worms":
            labels = cv2.connectedComponents(mask.view(np.uint8))[1].astype(np.uint8)
        yield Scene(source, Frame(mask=mask), labels=labels)


_FIXED_SCENES: Mapping[str, Callable[[Path], Iterable[Scene]]] = {
    "photographs": lambda folder: chain(_with_points(folder), _with_labels(folder)),
    "masks": _with_curve,
    "networks": _of_networks,
    "dashes": lambda folder: _of_cases(folder, "dashed-network-mask", "dashes"),
    "worms": lambda folder: _of_cases(folder, "worm-debris", "worms"),
}
_FILES = {
    "photographs": "cables/NNNNN.txt or mbest/*/NN.labels.png",
    "masks": "masks/NNN.png",
    "networks": "networks/ewd/NAME.labels.png",
    "dashes": "cases/dashed-network-mask",
    "worms": "cases/worm-debris",
}


def _evenly(points: Points) -> Points:
    """Return the polyline through points, 1 px apart."""
    along = np.concatenate(([0.0], np.cumsum(np.hypot(*np.diff(points, axis=0).T))))
    at = np.arange(along[-1])
    return np.column_stack([np.interp(at, along, column) for column in points.T])
