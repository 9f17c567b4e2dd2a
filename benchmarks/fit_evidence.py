"""Fit what an image and depth say about gaps to labelled scenes.

Run it in the repository with ``python -m benchmarks.fit_evidence FOLDER``; the folder is that of
`benchmarks.pictured_gaps`, with recordings in ``motion``. It prints a page of the documents; ``--write`` writes it, and
the fitted numbers.
"""

from __future__ import annotations

import argparse
import re
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from itertools import islice
from pathlib import Path

import numpy as np
import numpy.typing as npt
from scipy.optimize import minimize_scalar

from benchmarks.fit_linking.confidence import fit_log_odds
from benchmarks.fit_linking.labels import OPEN, UNKNOWN, true_partners
from benchmarks.fit_linking.scenes import Scene, list_scenes, of_truth
from benchmarks.pictured_gaps import GROUNDS, KINDS, list_gaps
from dloftbs import Config, Frame
from dloftbs.config import DepthConfig, LinkingConfig
from dloftbs.evidence import EvidenceMap
from dloftbs.linking.end_matching import list_ends, list_joints
from dloftbs.linking.kernels import evidence_weights, joint_evidence
from dloftbs.linking.kernels.joint_features import prices
from dloftbs.linking.kernels.weights import JOINT
from dloftbs.linking.kernels.weights import OPEN as OPEN_COST
from dloftbs.pipeline.stages import run_stages
from dloftbs_lab.evaluation.suites import open_suite

PAGE = Path(__file__).parents[1] / "docs" / "maintainers" / "evidence-weights.md"
COLUMNS = (
    "image: 1",
    "greatest logarithm, along the gap, of how many times more probable the ground is than the cables",
    "square of that logarithm if it is positive, else 0",
    "depth: by how much the ground is more probable than a cable, on the average of all places",
    "greatest mean of two logarithms in a row of how many times more probable it is",
)
DRAWN = ("hidden", "drawn", "broken")
SUITES = {"rgb": (3, 0.3), "seen-occluders": (9, 0.06), "rgbd": (4, 0.25), "known-occluders": (8, 0.1)}
"""Suites, the step from one of their frames to the next that counts, and the share of their scenes."""

SOURCES = {
    "image": (*DRAWN, "rgb", "seen-occluders", *GROUNDS),
    "depth": ("hidden", "recorded", "rgbd", "known-occluders", GROUNDS[0]),
}
"""Sources of what an image shows, and of what depth does."""

SOURCES_IN_SIGHT = ("drawn", "broken", *GROUNDS)
"""Sources that show ends of two cables in plain sight: nothing hides a gap between two ends that stay open."""

_SEEDS = (1, 2)
_SUITE_SEED = 4444
_FRAMES = 40  # of each kind over each kind of ground
_AMOUNT = 0.5
_ON_EVIDENCE = """# The weights of what image and depth show

For maintainers; [the rules of linking](../linking-rules.md) say what they mean. Made by `python -m
benchmarks.fit_evidence`.

Image and depth decide between a gap that is hidden, or that the mask alone has, and ground in sight. Their log-odds L
are a weighted sum of columns, fitted to {hidden} gaps of one cable and {sight} between ends of two in plain sight,
among those that the mask alone bridges. Both kinds, and all sources, have equal weight. Each column is multiplied by
the share of the gap's places that are looked at. The columns of the image are fitted to frames
with an image and no depth, and those of depth to frames with no image.

| column | nats a unit |
| --- | ---: |
{weights}

Not all ends that belong to two cables have ground between them. Of the gaps between such ends, a share q of
{share:.2f} has. This q fits {apart} of them best, with equal weight for each source. So a joint gains
-log(q exp(-L) + 1 - q), at most {most:.2f} nats.

The table has the number of gaps that are read wrongly, each by itself. The mean of minus the logarithm of the truth's
probability is in brackets. The columns are: by the mask alone; with the image or depth; the same, with the source left
out of the fit. Behind one occluder, gaps that are not joined gain as much as those that are. So some sources have a
worse figure with the image or depth, but linking compares both kinds, and this table does not. The same cables lie over
all three kinds of grounds. No other source has ends in plain sight with depth than the one over photographs, so that it
cannot be left out.

| source | given | joined | not joined | mask alone | with it | left out |
| --- | --- | ---: | ---: | ---: | ---: | ---: |
{rows}
"""

Floats = npt.NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class SeenGap:
    """A gap that an image or depth says something about.

    Parameters
    ----------
    source : str
    given : str
        "image" or "depth".
    columns : numpy.ndarray, shape (5,)
        As `describe_pixels` and `describe_depths` have them; those of the other one are 0.
    by_mask : float
        Log-odds, by the mask alone, that it is one cable's, nats.
    joined : bool
        True if it is.
    both_end : bool
        True if both cables end there.
    """

    source: str
    given: str
    columns: Floats
    by_mask: float
    joined: bool
    both_end: bool


@dataclass(frozen=True, eq=False)
class Fit:
    """The weights of the columns, nats a unit, and the share of gaps of two cables that are ground in sight."""

    weights: Floats
    in_sight: float

    def gain(self, columns: Floats) -> Floats:
        """Return what images and depth say for joints, nats."""
        gained: Floats = -np.log(self.in_sight * np.exp(-columns @ self.weights) + 1.0 - self.in_sight)
        return gained


def main() -> None:
    """Collect the gaps, fit, and print or write the page and the numbers."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--write", action="store_true", help="write the numbers and the page")
    parser.add_argument("--amount", type=float, default=1.0, help="share of the scenes, to see that it runs")
    given = parser.parse_args()
    tasks = [
        (what, name, seed, given.amount, given.folder)
        for what, names in SOURCES.items()
        for name in names
        for seed in _SEEDS
    ]
    with ProcessPoolExecutor() as pool:
        gaps = [gap for part in pool.map(_gaps, *zip(*tasks, strict=True)) for gap in part]
    found = fit(gaps)
    page = report(gaps, found)
    print(page)
    if given.write:
        PAGE.write_text(page)
        _write(found)


def _gaps(what: str, source: str, seed: int, amount: float, folder: Path) -> list[SeenGap]:
    return list(list_seen_gaps(_scenes(source, seed, amount, folder), what))


def _scenes(source: str, seed: int, amount: float, folder: Path) -> Iterator[Scene]:
    if source in SUITES:
        step, share = SUITES[source]
        for sequence in open_suite(source, scale=share * amount, seed=_SUITE_SEED + seed).sequences:
            for index in range(0, len(sequence), step):
                yield of_truth(source, sequence.frame(index), sequence.truth(index))
    elif source in GROUNDS:
        grounds = sorted(folder.glob(source))
        if not grounds:
            raise SystemExit(f"{folder} lacks {source}")
        for kind in KINDS:
            for gap in islice(list_gaps(grounds, kind, seed, _FRAMES), max(int(_FRAMES * amount), 1)):
                yield Scene(source, gap.frame, gap.cables, off_px=2.0)
    else:
        yield from list_scenes(source, seed, _AMOUNT * amount, folder, whole=True)


def list_seen_gaps(scenes: Iterable[Scene], what: str) -> Iterator[SeenGap]:
    """Yield the gaps that masks alone bridge, whose truth is known, and that images, or depth, say anything about."""
    config, none = Config(), np.empty(0, dtype=np.int64)
    assert isinstance(config.linking, LinkingConfig)
    for scene in scenes:
        frame = _with(scene.frame, what)
        run = run_stages(frame, config, None)
        evidence = None if run.crop is None else EvidenceMap.of(frame, run.crop, DepthConfig())
        if run.graph is None or run.crop is None or evidence is None:
            continue
        ends = list_ends(run.graph, none, none)
        rows, columns, joints, opens = list_joints(run.graph, ends, config.linking.max_gap_widths, None, 0.0)
        partner = true_partners(scene, run.crop, run.graph)
        open_cost = prices(opens, OPEN_COST)
        by_mask = open_cost[rows] + open_cost[columns] - prices(joints, JOINT)
        pairs = np.stack((rows, columns), axis=1)
        gaps, lengths = joint_evidence.list_gaps(ends.nodes, ends.states, pairs)
        shown = np.hstack(evidence.at(run.graph).across(ends.ids[pairs[gaps]], lengths[gaps])[1:])
        for gap, seen in zip(gaps, shown, strict=True):
            one, other = ends.ids[pairs[gap]]
            true = {partner[one], partner[other]}
            if seen.any() and UNKNOWN not in true:
                yield SeenGap(scene.source, what, seen, by_mask[gap], bool(partner[one] == other), true == {OPEN})


def _with(frame: Frame, what: str) -> Frame:
    """Return the mask of a frame with its image, or with its depth."""
    if what == "image":
        return Frame(mask=frame.mask, image=frame.image)
    return Frame(mask=frame.mask, depth=frame.depth, camera=frame.camera, depth_unit_m=frame.depth_unit_m)


def fit(gaps: Sequence[SeenGap]) -> Fit:
    """Return the numbers under which what images and depth show is the most probable."""
    found = np.zeros(len(COLUMNS))
    for what, own in (("image", slice(3)), ("depth", slice(3, None))):
        sides = (
            [gap for gap in gaps if gap.given == what and gap.joined],
            [gap for gap in gaps if _is_in_sight(gap, what)],
        )
        weights = sum(map(len, sides)) * np.concatenate([_alike(side) for side in sides])
        columns = np.array([gap.columns[own] for side in sides for gap in side])
        found[own] = fit_log_odds(columns, np.repeat((True, False), [len(side) for side in sides]), weights)
    apart = [gap for gap in gaps if not gap.joined]
    odds = np.exp(-np.array([gap.columns for gap in apart]) @ found)
    each = _alike(apart)
    share = minimize_scalar(lambda q: -(each @ np.log(q * odds + 1.0 - q)), bounds=(0.0, 0.99), method="bounded").x
    return Fit(found, float(share))


def _is_in_sight(gap: SeenGap, what: str) -> bool:
    """Return True for a gap between two ends in plain sight, of those with an image or of those with depth."""
    return gap.given == what and gap.both_end and gap.source in SOURCES_IN_SIGHT


def _alike(gaps: Sequence[SeenGap]) -> Floats:
    """Return weights of gaps, so that sources count alike, and all together 1."""
    counts = Counter((gap.given, gap.source) for gap in gaps)
    return np.array([1.0 / (counts[gap.given, gap.source] * len(counts)) for gap in gaps])


def report(gaps: Sequence[SeenGap], found: Fit) -> str:
    """Return the page on the weights, in Markdown."""
    rows = []
    for what, source in ((what, source) for what, names in SOURCES.items() for source in names):
        own = [gap for gap in gaps if (gap.given, gap.source) == (what, source)]
        if not own:
            continue
        rest = [gap for gap in gaps if (gap.given, gap.source) != (what, source)]
        left_out = _cell(own, fit(rest)) if any(_is_in_sight(gap, what) for gap in rest) else "-"
        joined = sum(gap.joined for gap in own)
        cells = [_cell(own, Fit(np.zeros(len(COLUMNS)), 0.0)), _cell(own, found), left_out]
        rows.append(f"| {source} | {what} | {joined} | {len(own) - joined} | {' | '.join(cells)} |")
    return _ON_EVIDENCE.format(
        hidden=sum(gap.joined for gap in gaps),
        sight=sum(_is_in_sight(gap, gap.given) for gap in gaps),
        weights="\n".join(f"| {what} | {one:.2f} |" for what, one in zip(COLUMNS, found.weights, strict=True)),
        share=found.in_sight,
        apart=sum(not gap.joined for gap in gaps),
        most=-np.log(1.0 - found.in_sight),
        rows="\n".join(rows),
    )


def _cell(gaps: Sequence[SeenGap], found: Fit) -> str:
    log_odds = np.array([gap.by_mask for gap in gaps]) + found.gain(np.array([gap.columns for gap in gaps]))
    right = np.where([gap.joined for gap in gaps], log_odds, -log_odds)
    return f"{int((right < 0.0).sum())} ({np.logaddexp(0.0, -right).mean():.3f})"


def _write(found: Fit) -> None:
    path = Path(evidence_weights.__file__)
    text = path.read_text()
    for name, weights in (("PIXELS", found.weights[:3]), ("DEPTHS", found.weights[3:])):
        numbers = ", ".join(f"{one:.2f}" for one in weights)
        text, arrays = re.subn(rf"(?<={name} = np\.array\(\[).*(?=\])", numbers, text)
        assert arrays == 1, path
    text, shares = re.subn(r"(?<=SHARE_IN_SIGHT = )[0-9.]+", f"{found.in_sight:.2f}", text)
    assert shares == 1, path
    path.write_text(text)


if __name__ == "__main__":
    main()
