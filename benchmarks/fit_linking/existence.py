"""Objects of masks, and whether each is a cable: what the existence of an object is fitted to."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
import numpy.typing as npt
from scipy.interpolate import make_interp_spline
from scipy.spatial import cKDTree

from benchmarks.fit_linking.confidence import fit_log_odds
from benchmarks.fit_linking.readings import Floats
from benchmarks.fit_linking.scenes import Points, Scene
from dloftbs import Config, Detection, Frame
from dloftbs.linking.existence import size_of
from dloftbs.pipeline.stages import run_stages

PIECES = "pieces"
"""Drawn cables that are short, thin, or of very different widths: all of them are there."""

NETWORKS = ("ResNet-101", "ResNet-50", "ResNet-101, branched")
"""Sources with labelled pixels, by the network that made the masks."""

_ALL = Config().replace({"linking.min_probability": 0.0})
_OF_A_SOURCE = 100.0  # objects that each source counts for
_LEAST = 0.1  # of a cable, that a piece of it shows in the mask of a network
_ON = 0.5  # of an object, on what is labelled or known
_MIN_OFF_PX = 5.0  # of a curve from the cable that it lies on, or its width
_LEVELS = (32, 128)  # of a network's output, from which it is a mask


@dataclass(frozen=True)
class Found:
    """An object that is not the largest, its share of the largest one's size, and whether it is a cable."""

    source: str
    share: float
    is_cable: bool


def list_objects(scenes: Iterable[Scene]) -> Iterator[Found]:
    """Yield the objects of masks alone, all but the largest one of each.

    One is a cable if half of it lies on what is known to be cable; where pixels are labelled, it is a tenth of that
    cable besides: what a network leaves of one in crumbs is as wrong as what it takes for one.
    """
    for scene in scenes:
        if scene.frame.image is not None or scene.frame.depth is not None or scene.frame.mask is None:
            continue
        found = run_stages(scene.frame, _ALL, None).detections
        sizes = [size_of(one.centerline) for one in found]
        for one, size in zip(found, sizes, strict=True):
            if size < max(sizes):
                yield Found(scene.source, size / max(sizes), _is_cable(one, scene))


def _is_cable(found: Detection, scene: Scene) -> bool:
    points = found.curve.sample(max(int(found.curve.length), 10))
    if scene.labels is None:
        off = np.min([cKDTree(curve).query(points)[0] for curve in scene.curves], axis=0)
        return float((off < max(found.width_px, _MIN_OFF_PX, scene.off_px)).mean()) >= _ON
    height, width = scene.labels.shape
    x, y = np.clip(np.rint(points), 0, (width - 1, height - 1)).astype(int).T
    own = scene.labels[y, x]
    if (own > 0).mean() < _ON:
        return False
    label = np.bincount(own[own > 0]).argmax()
    return bool(len(points) * found.width_px >= _LEAST * np.count_nonzero(scene.labels == label))


def networks_scenes(folder: Path) -> Iterator[Scene]:
    """Yield the masks that two networks make of photographs of cables, and one of harnesses, with labelled pixels."""
    for path in sorted(folder.glob("networks/ewd/*.labels.png")):
        labels, stem = _grey(path), path.name.removesuffix(".labels.png")
        for source, network in zip(NETWORKS, ("r101", "r50"), strict=False):
            grey = _grey(path.with_name(f"{stem}.{network}.png"))
            for level in _LEVELS:
                yield Scene(source, Frame(mask=grey >= level), labels=labels)
    for path in sorted(folder.glob("networks/bwh/*.r101.png")):
        stem = path.name.removesuffix(".r101.png")
        routes = [_grey(one) > 0 for one in sorted(path.parent.glob(f"{stem}.route_*.png"))]
        yield Scene(NETWORKS[2], Frame(mask=_grey(path) >= _LEVELS[1]), labels=np.any(routes, axis=0).astype(np.uint8))


def _grey(path: Path) -> npt.NDArray[np.uint8]:
    return np.asarray(cv2.imread(str(path), cv2.IMREAD_GRAYSCALE), np.uint8)


def piece_scenes(seed: int, count: int) -> Iterator[Scene]:
    """Yield drawn scenes of one to six cables apart, half of them of one width, some beside a hose."""
    rng = np.random.default_rng(seed)
    for _ in range(count):
        height = int(rng.choice([240, 480, 720]))
        size = height, int(height * rng.choice([4 / 3, 16 / 9]))
        is_mixed, hose = rng.random() < 0.5, rng.random() < 0.2
        usual = np.exp(rng.uniform(np.log(2.5), np.log(16.0)))
        mask, curves = np.zeros(size, np.uint8), list[Points]()
        for number in range(int(rng.integers(1, 7))):
            width = usual * np.exp(rng.normal(0.0, 0.25))
            length = min(width * np.exp(rng.uniform(np.log(7.0), np.log(80.0))), 0.9 * size[1])
            if is_mixed or hose:
                width = np.exp(rng.uniform(np.log(2.5), np.log(18.0)))
                length = height * np.exp(rng.uniform(np.log(0.2 if hose else 0.12), 0.0))
            if hose:
                width = rng.uniform(25.0, 60.0) * height / 720.0 if number == 0 else rng.uniform(2.0, 6.0)
            curve, drawn = _draw_bent(rng, size, width, length)
            if not (cv2.dilate(drawn, np.ones((5, 5), np.uint8)) & mask).any():
                mask |= drawn
                curves.append(curve)
        yield Scene(PIECES, Frame(mask=mask > 0), tuple(curves))


def _draw_bent(
    rng: np.random.Generator, size: tuple[int, int], width: float, length: float
) -> tuple[Points, npt.NDArray[np.uint8]]:
    """Return a bent curve somewhere in an image, and its mask."""
    knots = max(int(length / (4.0 * width)), 4)
    angles = np.cumsum(rng.normal(0.0, 0.35, knots)) + rng.uniform(0.0, 2.0 * np.pi)
    points = np.cumsum(np.column_stack((np.cos(angles), np.sin(angles))) * length / knots, axis=0)
    points += rng.uniform((0.0, 0.0), size[::-1]) - points.mean(axis=0)
    curve: Points = make_interp_spline(np.linspace(0.0, 1.0, knots), points, 3)(np.linspace(0.0, 1.0, int(length)))
    drawn = np.zeros(size, np.uint8)
    cv2.polylines(drawn, [np.rint(16.0 * curve).astype(np.int32)], False, 1, max(round(width), 1), shift=4)
    return curve, drawn


def fit_existence(objects: Sequence[Found]) -> Floats:
    """Return the log-odds that an object as large as the largest is a cable, and what a unit of log size adds.

    Sources count alike, and all networks together as one.
    """
    sources = ["networks" if one.source in NETWORKS else one.source for one in objects]
    counts = Counter(sources)
    weights = np.array([_OF_A_SOURCE / counts[source] for source in sources])
    return fit_log_odds(_columns(objects), np.array([one.is_cable for one in objects]), weights)


def state_existence(objects: Sequence[Found], line: Floats) -> Floats:
    """Return the existence that a line gives each object."""
    stated: Floats = 1.0 / (1.0 + np.exp(-_columns(objects) @ line))
    return stated


def _columns(objects: Sequence[Found]) -> Floats:
    return np.array([(1.0, np.log(one.share)) for one in objects])
