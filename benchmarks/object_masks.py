"""A mask per object as evidence: recorded motion of two to four cables, with the mistakes that segmenters make."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Sequence
from pathlib import Path

import cv2
import numpy as np
import numpy.typing as npt
from scipy.optimize import linear_sum_assignment
from scipy.spatial import cKDTree

import dloftbs
from dloftbs.data.instance_labels import paint
from dloftbs_lab.synthetic.real_motion import real_motion

_NEAR_PX = 3.0
_EVERY = 30

_Mask = npt.NDArray[np.bool_]
_Labels = npt.NDArray[np.uint16]
_Tool = Callable[[Sequence[_Mask], np.random.Generator], _Labels]


def cut(share: float, merged: float) -> _Tool:
    """Return a tool that gives each part of a share of the cables a number, and merges two objects now and then."""

    def label(masks: Sequence[_Mask], rng: np.random.Generator) -> _Labels:
        labels = np.zeros(masks[0].shape, np.uint16)
        count = 0
        for k in rng.permutation(len(masks)):
            _, parts = cv2.connectedComponents(masks[k].astype(np.uint8), connectivity=8)
            if rng.random() >= share:
                parts = np.minimum(parts, 1)
            labels[masks[k]] = parts[masks[k]] + count
            count += int(parts.max())
        if rng.random() < merged and count > 1:
            one, other = rng.choice(np.arange(1, count + 1), 2, replace=False)
            labels[labels == one] = other
        return labels

    return label


def twice(masks: Sequence[_Mask], rng: np.random.Generator) -> _Labels:
    """Return labels of a tool that finds each cable twice, two pixels apart."""
    return paint(one for mask in masks for one in (mask, np.roll(mask, (2, 1), (0, 1))))


def without_one(masks: Sequence[_Mask], rng: np.random.Generator) -> _Labels:
    """Return labels of a tool that misses a cable."""
    return paint(masks[1:])


def halves(masks: Sequence[_Mask], rng: np.random.Generator) -> _Labels:
    """Return labels of a tool that finds the right half of each cable as a part of it, too."""
    columns = np.arange(masks[0].shape[1])
    return paint(one for mask in masks for one in (mask, mask & (columns > np.median(np.nonzero(mask)[1]))))


def ragged(masks: Sequence[_Mask], rng: np.random.Generator) -> _Labels:
    """Return labels whose outlines wave by a pixel or two."""
    labels = paint(masks)
    h, w = labels.shape
    dx, dy = (cv2.resize(rng.normal(0.0, 1.5, (h // 6, w // 6)).astype(np.float32), (w, h)) for _ in range(2))
    rows, columns = np.mgrid[:h, :w].astype(np.float32)
    return cv2.remap(labels.astype(np.float32), columns + dx, rows + dy, cv2.INTER_NEAREST).astype(np.uint16)


def speckled(masks: Sequence[_Mask], rng: np.random.Generator) -> _Labels:
    """Return labels of which two in a hundred are of any object."""
    labels = paint(masks)
    wrong = (rng.random(labels.shape) < 0.02) & (labels > 0)
    labels[wrong] = rng.integers(1, len(masks) + 1, int(wrong.sum()))
    return labels


TOOLS: dict[str, _Tool | None] = {
    "none": None,
    "without a mistake": cut(0.0, 0.0),
    "three in ten cables cut at crossings, two merged in one frame of ten": cut(0.3, 0.1),
    "all cut": cut(1.0, 0.0),
    "all cut, two merged in every other frame": cut(1.0, 0.5),
    "each cable twice": twice,
    "one cable missed": without_one,
    "half of each cable once more": halves,
    "ragged outlines": ragged,
    "speckles": speckled,
}


def are_right(found: dloftbs.FrameResult, curves: Sequence[dloftbs.Curve]) -> tuple[bool, bool]:
    """Return whether all curves of a frame are found, and nothing else, and whether their number is right."""
    if len(found) != len(curves):
        return False, False
    ours, true = [one.curve.sample(300) for one in found], [one.sample(300) for one in curves]
    apart = np.array([[max(cKDTree(a).query(b)[0].mean(), cKDTree(b).query(a)[0].mean()) for b in true] for a in ours])
    return bool((apart[linear_sum_assignment(apart)] < _NEAR_PX).all()), True


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("motion", type=Path, help="folder of the recordings")
    parser.add_argument("--seed", type=int, default=47)
    parser.add_argument("--scale", type=float, default=0.3, help="share of the sequences")
    options = parser.parse_args()
    frames = []
    for sequence in real_motion(options.motion, options.scale, options.seed):
        for index in range(0, len(sequence), _EVERY):
            frame, truth = sequence.frame(index), sequence.truth(index)
            if len(truth.curves) > 1 and frame.image is None and frame.depth is None:
                frames.append((np.asarray(frame.mask) != 0, truth))
    print(f"| labels, {len(frames)} frames | all curves right | right number |\n| --- | ---: | ---: |")
    for name, tool in TOOLS.items():
        rng = np.random.default_rng(3)
        right = []
        for mask, truth in frames:
            labels = None if tool is None else np.where(mask, tool(truth.visible_masks, rng), 0).astype(np.uint16)
            right.append(are_right(dloftbs.detect(dloftbs.Frame(mask=mask, instances=labels)), truth.curves))
        print("| {} | {:.2f} | {:.2f} |".format(name, *np.mean(right, axis=0)), flush=True)


if __name__ == "__main__":
    main()
