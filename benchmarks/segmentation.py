"""How well a colour learned from strokes finds cables in pictures that nobody drew on.

Run it with ``python -m benchmarks.segmentation [--photographs FOLDER] [--seeds N]``. Of each set of ten pictures one is
drawn on, as a person does: two strokes a cable, with a trembling hand, then through what the mask of this picture gets
wrong. That is round 1. Round 2 adds the worst other picture, in the same way. The IoU of the union of cables is that of
pictures that nobody drew on; beside it stands that of the best table of colours. FOLDER has photographs as
`benchmarks.photographs` takes them; without it only drawn scenes are measured.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Iterator, Sequence
from pathlib import Path

import cv2
import numpy as np
import numpy.typing as npt

from benchmarks import segmentation_scenes as scenes
from benchmarks import segmentation_strokes as strokes
from benchmarks.segmentation_scenes import Picture, Rng
from dloftbs.segmentation import ColourModel, Stroke, log_colours

_SET = 10
_BEST_RATIO = 0.7  # of counts of cable to ground: the IoU of all pixels together is largest from 0.5 to 0.9
_SAME_LAMP = 0.3  # as much as between photographs: black, grey and white are told by lightness alone
_GREYS = {"black": 22.0, "grey": 85.0, "white": 225.0}


def main() -> None:
    """Print a table in Markdown, a row per kind of pictures."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--photographs", type=Path, default=Path("../shared/data/mbest"))
    parser.add_argument("--seeds", type=int, default=2)
    parser.add_argument("--first-seed", type=int, default=0)
    parser.add_argument("--kinds", default="", help="only kinds whose names begin so")
    given = parser.parse_args()
    kinds = ["mbest", "mbest on busy", "coloured on busy", "black", "grey", "white"]
    if not given.photographs.is_dir():
        print(f"{given.photographs} is missing: only drawn scenes are measured\n")
        kinds = [kind for kind in kinds if not kind.startswith("mbest")]
    print("| pictures | sets | round 1: mean | worst tenth | round 2: mean | worst tenth | best: mean | worst tenth |")
    print("| --- | ---: | ---: | ---: | ---: | ---: | ---: | ---: |")
    seeds = range(given.first_seed, given.first_seed + given.seeds)
    for kind in (kind for kind in kinds if kind.startswith(given.kinds)):
        found = [score(pictures, rng) for pictures, rng in sets(kind, given.photographs, seeds)]
        cells = [cell for round_ in zip(*found, strict=True) for cell in summary(round_)]
        print(f"| {kind} | {len(found)} | {' | '.join(cells)} |", flush=True)


def sets(kind: str, folder: Path, seeds: Sequence[int]) -> Iterator[tuple[list[Picture], Rng]]:
    """Yield sets of ten pictures of a kind."""
    for seed in seeds:
        if kind.startswith("mbest"):
            for place in scenes.matching(folder, "S*"):
                photographs = scenes.photographs(place)
                for first in range(0, len(photographs), _SET):
                    rng = np.random.default_rng([seed, first, int(place.name[1:])])
                    some = photographs[first : first + _SET]
                    if kind != "mbest":
                        name = scenes.BUSY[int(rng.integers(len(scenes.BUSY)))]
                        some = [scenes.pasted(p, scenes.busy_ground(name, p.labels.shape, rng)) for p in some]
                    yield [some[k] for k in rng.permutation(len(some))], rng
        elif kind == "coloured on busy":
            for number, name in enumerate(scenes.BUSY):
                rng = np.random.default_rng([seed, number, 77])
                hues = rng.uniform(0.0, 180.0, 2)
                dyes = [_dye(hue, rng) for hue in hues]
                yield (
                    [
                        scenes.drawn(scenes.busy_ground(name, scenes.SIZE, rng), dyes, rng.uniform(7.0, 14.0), rng)
                        for _ in range(_SET)
                    ],
                    rng,
                )
        else:
            for number, ground in enumerate((scenes.wood, scenes.steel)):
                rng = np.random.default_rng([seed, number, len(kind)])
                dye = np.full(3, _GREYS[kind]) * np.exp(rng.normal(0.0, 0.02, 3))
                yield (
                    [scenes.drawn(ground(rng), [dye], rng.uniform(7.0, 14.0), rng, _SAME_LAMP) for _ in range(_SET)],
                    rng,
                )


def _dye(hue: float, rng: Rng) -> npt.NDArray[np.float64]:
    hsv = np.array([[[hue, rng.uniform(130.0, 250.0), rng.uniform(120.0, 240.0)]]]).round().astype(np.uint8)
    return cv2.cvtColor(hsv, cv2.COLOR_HSV2BGR)[0, 0].astype(np.float64)


def score(pictures: Sequence[Picture], rng: Rng) -> tuple[list[float], list[float], list[float]]:
    """Return the IoU of the pictures that nobody drew on, after each round, and that of the best table of colours."""
    drawn_on = [(pictures[0], strokes.along_cables(pictures[0], rng))]
    model = _fit(drawn_on)
    more = strokes.corrections(pictures[0], model(pictures[0].image), rng)
    if more:
        drawn_on = [(pictures[0], [*drawn_on[0][1], *more])]
        model = _fit(drawn_on)
    others = list(pictures[1:])
    first = [iou(model(picture.image), picture) for picture in others]
    worst = others.pop(int(np.argmin(first)))
    more = strokes.along_cables(worst, rng, 1) + strokes.corrections(worst, model(worst.image), rng)
    model = _fit([*drawn_on, (worst, more)])
    return first, [iou(model(picture.image), picture) for picture in others], best(pictures)


def best(pictures: Sequence[Picture]) -> list[float]:
    """Return the IoU of a table of colours that is made of all labels of all pictures: no colour can do better."""
    cells = [log_colours.cells_of(picture.image) for picture in pictures]
    counts = np.zeros((2, log_colours.CELLS**3))
    for own, picture in zip(cells, pictures, strict=True):
        for kind, where in enumerate((picture.labels == 0, picture.labels > 0)):
            counts[kind] += np.bincount(own[where], minlength=log_colours.CELLS**3)
    table = (counts[1] > _BEST_RATIO * counts[0]).astype(np.uint8)
    return [iou(table[own], picture) for own, picture in zip(cells, pictures, strict=True)]


def _fit(drawn_on: Sequence[tuple[Picture, list[Stroke]]]) -> ColourModel:
    return ColourModel.fit_many([(picture.image, lines, "") for picture, lines in drawn_on])


def iou(mask: npt.NDArray[np.uint8] | npt.NDArray[np.bool_], picture: Picture) -> float:
    """Return the intersection over the union of a mask and the cables."""
    found, true = mask > 0, picture.labels > 0
    return int(np.count_nonzero(found & true)) / max(int(np.count_nonzero(found | true)), 1)


def summary(found: Sequence[Sequence[float]]) -> tuple[str, str]:
    """Return the mean of all pictures, and that of their worst tenth."""
    values = np.sort(np.concatenate([np.array(one) for one in found]))
    worst = values[: max(1, len(values) // 10)]
    return f"{values.mean():.3f}", f"{worst.mean():.3f}"


if __name__ == "__main__":
    start = time.perf_counter()
    main()
    print(f"\n{time.perf_counter() - start:.0f} s")
