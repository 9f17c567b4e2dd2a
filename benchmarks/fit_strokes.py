"""Fits the line prior of the pixel classifier: which probabilities of pixels make a cable.

Run it with ``python -m benchmarks.fit_strokes [--write]``. Strokes are drawn on photographs with labels, two a cable
and 80 px long, with a hand that trembles and one that does not; a classifier is fitted to each, and its probabilities
are read by the prior, which gradient boosting (scikit-learn's) fits to the labels. Each set of photographs is also left
out, and the IoU on it is stated. ``--write`` makes `dloftbs.segmentation.line_prior_trees` of all sets.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
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
    places = sorted((_DATA / "mbest").glob("S*"))
    photographs = [scenes.photographs(place) for place in places]
    sets["mbest"] = [some[first : first + 10 : 3] for some in photographs for first in range(0, len(some), 10)]
    sets["ariadne"] = [[picture] for picture in ariadne_pictures(_DATA / "cables")]
    return sets


def labelled_pictures(folder: Path, kind: str) -> list[Picture]:
    """Return the photographs of a class of EWD."""
    return [picture for path, picture in _with_labels(folder) if path.name.startswith(kind)]


def _with_labels(folder: Path) -> Iterator[tuple[Path, Picture]]:
    for path in sorted(folder.glob("*.jpg")):
        labels = cv2.imread(str(path.with_suffix(".labels.png")), cv2.IMREAD_GRAYSCALE)
        yield path, Picture(np.asarray(cv2.imread(str(path)), np.uint8), np.asarray(labels, np.uint8))


def ariadne_pictures(folder: Path) -> list[Picture]:
    """Return Ariadne's photographs, their masks as labels."""
    pictures = []
    for path in sorted(folder.glob("*.jpg")):
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
    """Return trees and the log-odds before them."""
    from sklearn.ensemble import HistGradientBoostingClassifier

    boosted = HistGradientBoostingClassifier(
        max_iter=60, max_depth=4, learning_rate=0.12, early_stopping=False, random_state=0
    )
    boosted.fit(np.concatenate([case.features for case in cases]), np.concatenate([case.is_cable for case in cases]))
    nodes: list[tuple[int, int, int, float]] = []
    roots = []
    for (tree,) in boosted._predictors:
        roots.append(len(nodes))
        _unroll(tree.nodes, 0, nodes)
    feature, threshold, other, value = zip(*nodes, strict=True)
    trees = Trees(
        np.array(feature, np.int16),
        np.array(threshold, np.uint8),
        np.array(other, np.int32),
        np.array(value, np.float32),
        np.array(roots, np.int32),
    )
    return trees, float(np.ravel(boosted._baseline_prediction)[0]) + float(np.log((1.0 - _AT) / _AT))


def _unroll(tree: npt.NDArray[np.void], at: int, nodes: list[tuple[int, int, int, float]]) -> None:
    """Append a node of scikit-learn's and those below it, as `kernels.forest.grow` orders them."""
    node, place = tree[at], len(nodes)
    if node["is_leaf"]:
        nodes.append((-1, 0, place, float(node["value"])))
        return
    nodes.append((0, 0, 0, 0.0))
    _unroll(tree, node["left"], nodes)
    nodes[place] = int(node["feature_idx"]), int(node["num_threshold"]), len(nodes), 0.0
    _unroll(tree, node["right"], nodes)


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
