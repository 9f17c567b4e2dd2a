"""How well cables are told apart in real photographs whose pixels are labelled.

Run it with ``python -m benchmarks.photographs FOLDER``, where each folder in it holds photographs ``NN.jpg`` and
``NN.labels.png``, whose pixel value is the cable's number (0 is background), as the public data set of mBEST (Choi et
al., RA-L 2023) has them. The mask is what is labelled at all, without the numbers. Each of its pixels is given to the
nearest curve, and at a crossing to the cable that the image shows on top; DICE compares that with the labels.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import cv2
import numpy as np
import numpy.typing as npt
from scipy.optimize import linear_sum_assignment
from scipy.spatial import cKDTree

import dloftbs

_SAMPLES = 1500
_NEAR_WIDTHS = 2.5

Ints = npt.NDArray[np.int64]


def main() -> None:
    """Print a table in Markdown, a row per folder."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path)
    given = parser.parse_args()
    print("| photographs | method | right count | DICE | worst |")
    print("| --- | --- | ---: | ---: | ---: |")
    for name, config in (("default", dloftbs.Config()), ("paper", dloftbs.Config.paper())):
        pipeline = dloftbs.Pipeline(config)
        for folder in sorted(path for path in given.folder.iterdir() if path.is_dir()):
            scores = [score(pipeline, path) for path in sorted(folder.glob("*.jpg"))]
            right, dices = sum(right for right, _ in scores), [dice for _, dice in scores]
            print(f"| {folder.name} | {name} | {right} of {len(scores)} | {np.mean(dices):.4f} | {min(dices):.4f} |")


def score(pipeline: dloftbs.Pipeline, photograph: Path) -> tuple[bool, float]:
    """Return whether the number of curves is right, and the mean DICE of the cables."""
    labels = np.asarray(cv2.imread(str(photograph.with_suffix(".labels.png")), cv2.IMREAD_GRAYSCALE))
    image = np.asarray(cv2.imread(str(photograph)), dtype=np.uint8)
    result = pipeline.detect(dloftbs.Frame(image=image, mask=labels > 0))
    rows, columns = np.nonzero(labels)
    true = labels[rows, columns]
    numbers = np.unique(true)
    if not result.detections:
        return False, 0.0
    found = assign(result, np.column_stack((columns, rows)).astype(np.float64))
    count = len(result.detections)
    dice = np.array([[overlap(found == k, true == number) for k in range(count)] for number in numbers])
    pairs = linear_sum_assignment(-dice)
    return count == len(numbers), float(dice[pairs].sum() / len(numbers))


def assign(result: dloftbs.FrameResult, pixels: npt.NDArray[np.float64]) -> Ints:
    """Return the index of the detection that each pixel (n, 2) belongs to, shape (n,)."""
    detections = result.detections
    distance = np.stack([cKDTree(d.curve.sample(_SAMPLES)).query(pixels)[0] for d in detections])
    found: Ints = distance.argmin(axis=0)
    for crossing in result.crossings:
        if crossing.top is not None:
            top = crossing.passes[crossing.top][0]
            width = detections[top].width_px
            near = np.linalg.norm(pixels - crossing.position, axis=1) < _NEAR_WIDTHS * width
            found[near & (distance[top] <= 0.5 * width + 0.5)] = top
    return found


def overlap(one: npt.NDArray[np.bool_], other: npt.NDArray[np.bool_]) -> float:
    """Return the DICE of two sets."""
    return 2.0 * float(np.sum(one & other)) / float(np.sum(one) + np.sum(other))


if __name__ == "__main__":
    main()
