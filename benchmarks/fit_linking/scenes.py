"""Scenes whose true joints are known, from sources that differ."""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal

import cv2
import numpy as np
import numpy.typing as npt

from dloftbs import Frame, synthetic
from dloftbs.sources import KnownSequence
from dloftbs.truth import Truth

SOURCES = {
    "generated": "cables of the kinds and of tracking sequences, noisy, from 5 px on; two that touch, in poor depth",
    "covered": "one and three cables of the kinds behind discs, the mask alone",
    "hidden": "one, three and five cables behind moving discs and bars, with mask, image, depth and occluders",
    "simulated": "a cable moved by MuJoCo, in perspective",
    "drawn": "edge cases: sharp bends, ends that face each other, T, Y, cables side by side, crossed rings, near frays",
    "broken": "drawn cables whose masks are broken in places, and ends of two that are as near to each other",
    "photographs": "of cables, with points along each or labelled pixels; nothing of them is kept",
    "masks": "of single cables in photographs, by the authors of DLOFTBs, with gaps; nothing of them is kept",
}

FIXED = ("photographs", "masks")
"""Sources that are the same with every seed."""

_POINTS_OFF_PX = 6.0  # of points that a person clicked along a cable
_BROKEN = ("broken", "ends near each other", "broken, picture", "close ends, picture")
_UNREADABLE = "close ends, picture"
"""Whose masks, alone, are those of broken ones."""
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


def list_scenes(source: str, seed: int, amount: float, photographs: Path) -> Iterator[Scene]:
    """Yield the scenes of one source; photographs and masks are the same with every seed.

    Raises
    ------
    SystemExit
        If there are none.
    """
    if source in FIXED:
        found = [*_with_points(photographs), *_with_labels(photographs)] if source == "photographs" else []
        found += _with_curve(photographs) if source == "masks" else []
        if not found:
            raise SystemExit(f"{photographs} lacks cables/NNNNN.txt, mbest/*/NN.labels.png or masks/NNN.png")
        yield from found
        return
    if source == "simulated" and not synthetic.simulation_available():
        raise SystemExit(f"no simulator: {synthetic.SIMULATION_REMEDY}")
    for sequence, step in _sequences(source, seed, amount):
        for index in range(0, len(sequence), step):
            truth = sequence.truth(index)
            if truth.curves:
                curves = tuple(curve.sample(max(int(curve.length), 20)) for curve in truth.curves)
                scene = Scene(source, sequence.frame(index), curves, truth)
                yield from [scene] if sequence.name == _UNREADABLE else _with_less(scene)


def _sequences(source: str, seed: int, amount: float) -> Iterator[tuple[KnownSequence, int]]:
    """Yield sequences and the step from one of their frames to the next that counts."""
    many = max(round(6 * amount), 1)
    if source == "drawn":
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


def _evenly(points: Points) -> Points:
    """Return the polyline through points, 1 px apart."""
    along = np.concatenate(([0.0], np.cumsum(np.hypot(*np.diff(points, axis=0).T))))
    at = np.arange(along[-1])
    return np.column_stack([np.interp(at, along, column) for column in points.T])
