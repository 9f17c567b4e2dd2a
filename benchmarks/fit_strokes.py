"""Fits the line prior of the pixel classifier: which probabilities of pixels make a cable.

Run it with ``python -m benchmarks.fit_strokes [--write]``. Strokes are drawn on photographs with labels, two a cable
and 80 px long, with a hand that trembles and one that does not; a classifier is fitted to each, and its probabilities
are read by the prior, which gradient boosting (scikit-learn's) fits to the labels. Each set of photographs is also left
out, and the IoU on it is stated. ``--write`` makes `dloftbs.segmentation.line_prior_trees` of all sets.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import cv2
import numpy as np
import numpy.typing as npt

from benchmarks import segmentation_scenes as scenes
from benchmarks import segmentation_strokes as strokes
from benchmarks.segmentation_scenes import Picture
from dloftbs.segmentation import ColourModel, line_prior_trees
from dloftbs.segmentation.line_prior import LinePrior, PixelMaps, line_features
from dloftbs.segmentation.trees import Trees

_DATA = Path("../shared/data")
_SAMPLES = 3000  # of a picture
_AT = 0.4  # probability that becomes one half: IoU is largest there in all sets that were left out
_TREES, _DEPTH, _TRIES, _LEAST, _RATE = 80, 6, 40, 50.0, 0.08  # of the boosting
_OF_A_TREE = 40000  # samples
_HANDS = (1.0, 0.0)  # tremble of the hand, as a multiple of the usual one


@dataclass(frozen=True, eq=False)
class _Case:
    """Maps of a picture, its labels, and the features and labels of some pixels."""

    maps: PixelMaps
    picture: Picture
    features: npt.NDArray[np.uint8]
    is_cable: npt.NDArray[np.bool_]


def main() -> None:
    """Print the IoU of each set by trees that were fitted to the others."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--write", action="store_true")
    write = parser.parse_args().write
    sets = {name: list(_cases(groups)) for name, groups in _pictures().items()}
    print(
        "| set | pictures | pixels alone | with the line prior | its worst tenth |\n| --- | ---: | ---: | ---: | ---: |"
    )
    for name, cases in sets.items():
        prior = LinePrior(*_fit([case for other, some in sets.items() if other != name for case in some]))
        alone = [_iou(case.maps.own / np.float32(255.0), case.picture) for case in cases]
        found = np.sort([_iou(prior(case.maps), case.picture) for case in cases])
        worst = found[: max(1, len(found) // 10)].mean()
        print(f"| {name} | {len(cases)} | {np.mean(alone):.3f} | {found.mean():.3f} | {worst:.3f} |", flush=True)
    if write:
        _write(*_fit([case for some in sets.values() for case in some]))


def _pictures() -> dict[str, list[list[Picture]]]:
    """Return the groups of each set: the first picture of a group is drawn on."""
    sets = {
        kind: [[picture] for picture in labelled_pictures(_DATA / "networks" / "ewd", kind)]
        for kind in ("c1", "c2", "c3")
    }
    places = scenes.matching(_DATA / "mbest", "S*")
    photographs = [scenes.photographs(place) for place in places]
    sets["mbest"] = [some[first : first + 10 : 3] for some in photographs for first in range(0, len(some), 10)]
    sets["ariadne"] = [[picture] for picture in ariadne_pictures(_DATA / "cables")]
    return sets


def labelled_pictures(folder: Path, kind: str) -> list[Picture]:
    """Return the photographs of a class of EWD."""
    return [picture for path, picture in _with_labels(folder) if path.name.startswith(kind)]


def _with_labels(folder: Path) -> Iterator[tuple[Path, Picture]]:
    for path in scenes.matching(folder, "*.jpg"):
        labels = cv2.imread(str(path.with_suffix(".labels.png")), cv2.IMREAD_GRAYSCALE)
        yield path, Picture(np.asarray(cv2.imread(str(path)), np.uint8), np.asarray(labels, np.uint8))


def ariadne_pictures(folder: Path) -> list[Picture]:
    """Return Ariadne's photographs, their masks as labels."""
    pictures = []
    for path in scenes.matching(folder, "*.jpg"):
        image = np.asarray(cv2.imread(str(path)), np.uint8)
        labels = np.zeros(image.shape[:2], np.uint8)
        for number, name in enumerate(sorted(folder.glob(f"{path.stem}_mask_[0-9]*.png")), 1):
            labels[np.asarray(cv2.imread(str(name), cv2.IMREAD_GRAYSCALE)) > 0] = number
        pictures.append(Picture(image, labels))
    return pictures


def _cases(groups: Sequence[Sequence[Picture]]) -> Iterator[_Case]:
    for number, (drawn, *others) in enumerate(groups):
        for seed, hand in enumerate(_HANDS):
            rng = np.random.default_rng([seed, number])
            model = ColourModel.fit(drawn.image, strokes.short_strokes(drawn, rng, hand))
            classifier = model.classifier
            if classifier is None:
                continue
            for picture in (drawn, *others):
                maps = classifier.maps(picture.image)
                size = maps.own.shape[1::-1]
                true = cv2.resize((picture.labels > 0).astype(np.float32), size, interpolation=cv2.INTER_AREA).ravel()
                pixels = rng.choice(maps.pixels, min(_SAMPLES, len(maps.pixels)), replace=False)
                yield _Case(maps, picture, line_features(maps, pixels), true[pixels] > 0.5)


def _fit(cases: Sequence[_Case]) -> tuple[Trees, float]:
    """Return trees and the log-odds before them, by gradient boosting with Newton's steps."""
    features = np.concatenate([case.features for case in cases], axis=1)
    is_cable = np.concatenate([case.is_cable for case in cases]).astype(np.float64)
    start = float(np.log(is_cable.mean() / (1.0 - is_cable.mean())))
    log_odds = np.full(len(is_cable), start)
    grown = []
    for number in range(_TREES):
        some = np.random.default_rng(number).choice(len(is_cable), min(_OF_A_TREE, len(is_cable)), replace=False)
        stated = 1.0 / (1.0 + np.exp(-log_odds[some]))
        weights = stated * (1.0 - stated) + 1e-6
        target = (is_cable[some] - stated) / weights
        tree = Trees.grown(features[:, some], target, weights, 1, _TRIES, _DEPTH, _LEAST, number)
        grown.append(replace(tree, value=_RATE * tree.value))
        log_odds += grown[-1].sums(features)
    trees = Trees(
        *(np.concatenate(parts) for parts in zip(*((t.feature, t.threshold, t.value) for t in grown), strict=True))
    )
    return trees, start + float(np.log((1.0 - _AT) / _AT))


def _iou(probability: npt.NDArray[np.float32], picture: Picture) -> float:
    size = picture.labels.shape[1::-1]
    found, true = cv2.resize(probability.astype(np.float32), size) >= 0.5, picture.labels > 0
    return int(np.count_nonzero(found & true)) / max(int(np.count_nonzero(found | true)), 1)


def _write(trees: Trees, start: float) -> None:
    text = trees.to_text()
    lines = "\n".join(f'    "{text[at : at + 108]}"' for at in range(0, len(text), 108))
    assert line_prior_trees.__file__ is not None
    Path(line_prior_trees.__file__).write_text(
        '"""Trees of the line prior, written by ``python -m benchmarks.fit_strokes --write``."""\n\n'
        f'START = {start:.4f}\n"""Logarithm of the odds of cable before the trees, in nats.\n\n'
        'Source: fitted by `benchmarks.fit_strokes`.\n"""\n'
        f'TREES = (\n{lines}\n)\n"""Nodes, as `Trees.to_text` keeps them.\n\n'
        'Source: fitted by `benchmarks.fit_strokes`.\n"""\n'
    )


if __name__ == "__main__":
    main()
