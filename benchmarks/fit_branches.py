"""Costs where objects branch, fitted on drawn harnesses and real motion, and the confidence of branch points.

``python -m benchmarks.fit_branches FILE...`` reads recordings as `branched_motion` does, and draws harnesses and
crossings with seeds of its own. It prints the share of scenes that are right for each cost of a branch's end and of
round ends, and the weights of `branch_weights.NODE` with what they say of each source that was left out.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

import dloftbs
from benchmarks.branched_motion import NODE_PX, SIZE, Scene, mask_of, scenes, score
from benchmarks.fit_linking.confidence import fit_log_odds
from dloftbs.linking import branch_points, branch_weights, end_matching
from dloftbs_lab.synthetic.degrade import NOISY, OCCLUDED
from dloftbs_lab.synthetic.harnesses import HarnessSequence

COSTS = {"BRANCH_END": (0.5, 1.0, 1.5, 2.0, 2.5, 3.0, 3.5), "ROUND_END": (0.0, 1.0, 2.0, 3.0, 4.0)}
FIRST_SEED = 5000


class Example(NamedTuple):
    """A mask, where it is from, and what it shows; a crossing has no branch point."""

    source: str
    mask: npt.NDArray[np.uint8]
    scene: Scene


def drawn(count: int) -> Iterator[Example]:
    """Yield drawn harnesses of 1 to 4 branches, each clean, noisy, and behind discs."""
    for k in range(count):
        branches = 1 + k % 4
        truth = HarnessSequence(branches, ("drawn", "in perspective")[k // 4 % 2], 1, seed=FIRST_SEED + k).truth(0)
        assert truth.mask is not None
        nodes = np.array([curve.end for curve in truth.curves[:branches]])
        scene = Scene([curve.sample(200) for curve in truth.curves], nodes)
        yield Example("drawn", truth.mask.astype(np.uint8) * 255, scene)
        for name, one in (("noisy", NOISY), ("behind discs", OCCLUDED)):
            mask = one.apply(truth.mask, truth.curves, (FIRST_SEED, k))
            yield Example(f"drawn, {name}", mask.astype(np.uint8) * 255, scene)


def crossings(count: int) -> Iterator[Example]:
    """Yield two cables that cross at 20 to 90 degrees."""
    rng = np.random.default_rng(FIRST_SEED)
    for _ in range(count):
        angle, turn = np.radians(rng.uniform(20.0, 90.0)), rng.uniform(0.0, np.pi)
        lines = []
        for direction in (turn, turn + angle):
            way, along = np.array([np.cos(direction), np.sin(direction)]), np.linspace(-300.0, 300.0, 200)[:, None]
            bend = rng.uniform(-4e-4, 4e-4) * along * along * np.array([-way[1], way[0]])
            lines.append(np.array([SIZE[1], SIZE[0]]) / 2.0 + along * way + bend)
        scene = Scene(lines, np.empty((0, 2)))
        yield Example("crossings", mask_of(scene), scene)


def all_examples(files: list[Path], count: int) -> list[Example]:
    """Return the examples of all sources."""
    found = [*drawn(count), *crossings(count)]
    for path in files:
        found += [Example(path.stem, mask_of(scene), scene) for scene in scenes(path, 2, FIRST_SEED)]
    return found


def share_right(examples: list[Example]) -> dict[str, float]:
    """Return the share of scenes of each source that are right as a whole."""
    right: dict[str, list[bool]] = {}
    for one in examples:
        result = dloftbs.detect(one.mask, branched=True, mask_is="binary")
        right.setdefault(one.source, []).append(bool(score(one.scene, result)[4]))
    return {source: float(np.mean(values)) for source, values in right.items()}


def signs_of(examples: list[Example]) -> tuple[list[str], npt.NDArray[np.float64], npt.NDArray[np.bool_]]:
    """Return the sources, the signs (n, 1) and the rightness of all branch points that are found."""
    module: Any = branch_points
    kept, seen = module.confidence_of, []

    def record(shortest: float) -> float:
        seen.append([shortest])
        return len(seen) * 2.0**-20

    module.confidence_of = record
    try:
        sources, signs, right = [], [], []
        for one in examples:
            for point in dloftbs.detect(one.mask, branched=True, mask_is="binary").branch_points:
                away = np.hypot(*(one.scene.nodes - point.position).T)
                sources.append(one.source)
                signs.append(seen[round(point.confidence * 2.0**20) - 1])
                right.append(bool(len(away)) and bool(away.min() <= NODE_PX))
    finally:
        module.confidence_of = kept
    return sources, np.array(signs), np.array(right)


def main() -> None:
    """Fit both, and print them."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("files", type=Path, nargs="*")
    parser.add_argument("--count", type=int, default=64, help="drawn scenes of each kind")
    options = parser.parse_args()
    examples = all_examples(options.files, options.count)
    module: Any = end_matching
    for name, costs in COSTS.items():
        for cost in costs:
            setattr(module, name, cost)
            shares = share_right(examples)
            each = ", ".join(f"{source} {share:.3f}" for source, share in shares.items())
            print(f"{name} {cost:g}: {np.mean(list(shares.values())):.3f}  {each}", flush=True)
        setattr(module, name, getattr(branch_weights, name))
    sources, signs, right = signs_of(examples)
    shares_of_all = np.array([1.0 / sources.count(source) for source in sources])  # each source counts the same
    for left_out in [*dict.fromkeys(sources), None]:
        train = np.array([source != left_out for source in sources])
        columns = np.column_stack((np.ones(len(signs)), signs))
        weights = fit_log_odds(columns[train], right[train], shares_of_all[train])
        test = ~train if left_out is not None else train
        states = 1.0 / (1.0 + np.exp(-columns[test] @ weights))
        stated, share = (np.average(values, weights=shares_of_all[test]) for values in (states, right[test]))
        print(f"without {left_out}: {np.round(weights, 3)}; of {test.sum()}: stated {stated:.3f}, right {share:.3f}")


if __name__ == "__main__":
    main()
