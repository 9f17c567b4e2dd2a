"""The authors' own masks, with the curves that their implementation gave."""

from __future__ import annotations

import json
from pathlib import Path

import cv2
import numpy as np
import pytest
from scipy.spatial import cKDTree

import dloftbs
from dloftbs import Config

NAMES = [f"{i:03d}.png" for i in range(22)]


def dense(points: np.ndarray) -> np.ndarray:
    """Put twenty points on every piece of a polyline."""
    fine = np.linspace(0, len(points) - 1, 20 * len(points))
    return np.stack([np.interp(fine, np.arange(len(points)), axis) for axis in points.T], axis=1)


def mean_distance(a: np.ndarray, b: np.ndarray) -> float:
    """Return the mean distance from the points of one polyline to the other, densely sampled."""
    return float(cKDTree(dense(b)).query(dense(a))[0].mean())


@pytest.mark.parametrize("name", NAMES)
def test_the_published_method_gives_the_authors_curves(shared_data: Path, name: str) -> None:
    theirs = np.array(json.loads((shared_data / "masks" / "original_curves.json").read_text())[name])
    mask = cv2.imread(str(shared_data / "masks" / name), cv2.IMREAD_GRAYSCALE)
    (detection,) = dloftbs.detect(mask, Config.paper())
    ours = detection.curve.sample(500)
    assert mean_distance(ours, theirs) <= 1.0
    assert mean_distance(theirs, ours) <= 1.0


@pytest.mark.parametrize("folder", ["S1", "S2", "S3"])
def test_real_cables_are_covered_by_their_curves(shared_data: Path, folder: str) -> None:
    for path in sorted((shared_data / "mbest" / folder).glob("*.labels.png"))[::6]:
        mask = cv2.imread(str(path), cv2.IMREAD_GRAYSCALE) > 0
        curves = [d.curve.sample(800) for d in dloftbs.detect(mask, Config.paper())]
        pixels = np.argwhere(mask)[::7, ::-1]
        distance, _ = cKDTree(np.concatenate(curves)).query(pixels)
        assert (distance < 12).mean() > 0.97, path.name
