"""How well short strokes find the cables of photographs with busy grounds, on the picture that was drawn on.

Run it with ``python -m benchmarks.segmentation_photographs [--seeds N] [--kinds c1]``. Two strokes of 80 px a cable are
round 1; round 2 adds two strokes on what is missing most, and one on what is no cable. The IoU is that of the union of
cables; the number is right where `detect` finds as many objects as there are.
"""

from __future__ import annotations

import argparse
import time
from pathlib import Path

import cv2
import numpy as np

import dloftbs
from benchmarks import segmentation_strokes as strokes
from benchmarks.fit_strokes import ariadne_pictures, labelled_pictures
from benchmarks.segmentation import iou
from benchmarks.segmentation_scenes import Picture, Rng
from dloftbs.segmentation import ColourModel

_DATA = Path("../shared/data")
_RUNS = 10


def main() -> None:
    """Print a table in Markdown, a row per kind of photographs and round, and the time."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, default=2)
    parser.add_argument("--first-seed", type=int, default=100, help="not those of benchmarks.fit_strokes")
    parser.add_argument("--kinds", default="", help="only kinds whose names begin so")
    given = parser.parse_args()
    print("| photographs | round | IoU | worst tenth | recall | right number | colour alone |")
    print("| --- | ---: | ---: | ---: | ---: | ---: | ---: |")
    for kind in ("c1", "c2", "c3", "ariadne"):
        if not kind.startswith(given.kinds):
            continue
        folder = _DATA / "networks" / "ewd"
        pictures = ariadne_pictures(_DATA / "cables") if kind == "ariadne" else labelled_pictures(folder, kind)
        rows = [
            score(picture, np.random.default_rng([seed, number]))
            for seed in range(given.first_seed, given.first_seed + given.seeds)
            for number, picture in enumerate(pictures)
        ]
        for number, row in enumerate(np.array(rows).transpose(1, 2, 0), 1):
            worst = np.sort(row[0])[: max(1, row.shape[1] // 10)].mean()
            cells = (row[0].mean(), worst, *row[1:].mean(axis=1))
            print(f"| {kind} | {number} | " + " | ".join(f"{cell:.2f}" for cell in cells) + " |", flush=True)
    _print_times()


def score(picture: Picture, rng: Rng) -> list[tuple[float, ...]]:
    """Return the IoU, the recall, whether the number is right and whether the colour decides alone, a row a round."""
    drawn = strokes.short_strokes(picture, rng)
    rows: list[tuple[float, ...]] = []
    for _ in range(2):
        model = ColourModel.fit(picture.image, drawn)
        mask, true = model(picture.image), picture.labels > 0
        right = len(dloftbs.detect(picture.image, segmenter=model)) == len(picture.numbers)
        rows.append((iou(mask, picture), float(mask[true].mean()), float(right), float(model.by_colour_alone)))
        drawn = drawn + strokes.second_round(picture, mask, rng)
    return rows


def _print_times() -> None:
    """Print the time of an image of 1280 x 720 on one core, over that of ``cv2.cvtColor`` and ``cv2.inRange``."""
    cv2.setNumThreads(1)
    print("\n| photograph | ratio to cvtColor and inRange |\n| --- | ---: |")
    for kind in ("c1", "c2", "c3"):
        small = labelled_pictures(_DATA / "networks" / "ewd", kind)[0]
        labels = cv2.resize(small.labels, (1280, 720), interpolation=cv2.INTER_NEAREST)
        picture = Picture(np.asarray(cv2.resize(small.image, (1280, 720)), np.uint8), np.asarray(labels, np.uint8))
        image = picture.image
        model = ColourModel.fit(image, strokes.short_strokes(picture, np.random.default_rng(0)))
        floor, own = [], []
        for _ in range(_RUNS):
            since = time.thread_time()
            cv2.inRange(cv2.cvtColor(image, cv2.COLOR_BGR2HSV), (5, 40, 40), (22, 255, 255))
            between = time.thread_time()
            model(image)
            floor.append(between - since)
            own.append(time.thread_time() - between)
        print(f"| {kind} | {min(own) / min(floor):.1f} |", flush=True)


if __name__ == "__main__":
    main()
