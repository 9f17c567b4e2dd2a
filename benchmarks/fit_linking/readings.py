"""Labelled sets of ends: all readings of them, what is measured of each, and the true one."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from benchmarks.fit_linking.labels import OPEN, UNKNOWN, true_partners
from benchmarks.fit_linking.scenes import Scene
from dloftbs import Config
from dloftbs.config import DepthConfig, LinkingConfig
from dloftbs.evidence import EvidenceMap
from dloftbs.linking.end_matching import list_ends, list_joints
from dloftbs.pipeline.stages import run_stages

_MORE = 8.0  # nats by which a pair may cost more than two open ends and still counts as a candidate
_MAX_READINGS = 3000

Floats = npt.NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Choice:
    """All readings of a set of ends that have candidate joints with each other, and which of them is true.

    Parameters
    ----------
    source : str
    rows : numpy.ndarray, shape (readings, columns)
        Sums of the columns of the joints, and of the open ends, of each reading.
    true : int
    """

    source: str
    rows: Floats
    true: int


def list_choices(scenes: Iterable[Scene]) -> Iterator[Choice]:
    """Yield the labelled sets of ends of some scenes; those that are not labelled as a whole are left out."""
    config = Config()
    assert isinstance(config.linking, LinkingConfig)
    for scene in scenes:
        run = run_stages(scene.frame, config, None)
        if run.graph is None or run.crop is None:
            continue
        graph, crop, none = run.graph, run.crop, np.empty(0, dtype=np.int64)
        evidence = EvidenceMap.of(scene.frame, crop, DepthConfig())
        at_ends = None if evidence is None else evidence.at(graph)
        ends = list_ends(graph, none, none)
        rows, columns, joints, opens = list_joints(graph, ends, config.linking.max_gap_widths, at_ends, _MORE)
        partner = true_partners(scene, crop, graph)
        for members in _connected(rows, columns, len(partner)):
            choice = _choice(scene.source, members, rows, columns, joints, opens, partner)
            if choice is not None:
                yield choice


def _connected(rows: npt.NDArray[np.int64], columns: npt.NDArray[np.int64], count: int) -> list[list[int]]:
    """List the ends that candidate joints connect, set by set."""
    graph = coo_array((np.ones(len(rows)), (rows, columns)), shape=(count, count))
    _, number = connected_components(graph, directed=False)
    sets: dict[int, list[int]] = {}
    for end in sorted({*rows.tolist(), *columns.tolist()}):
        sets.setdefault(int(number[end]), []).append(end)
    return list(sets.values())


def _choice(
    source: str,
    members: list[int],
    rows: npt.NDArray[np.int64],
    columns: npt.NDArray[np.int64],
    joints: Floats,
    opens: Floats,
    partner: npt.NDArray[np.int64],
) -> Choice | None:
    """Return the readings of a set of ends; None if the true one is unknown, no candidate, or one of too many."""
    at = {end: k for k, end in enumerate(members)}
    own = [k for k, i in enumerate(rows.tolist()) if i in at]
    pairs = {(at[int(rows[k])], at[int(columns[k])]): k for k in own}
    true = set()
    for end in members:
        if partner[end] == UNKNOWN or (partner[end] != OPEN and int(partner[end]) not in at):
            return None
        if partner[end] != OPEN:
            true.add((min(at[end], at[int(partner[end])]), max(at[end], at[int(partner[end])])))
    if not true <= pairs.keys():
        return None
    readings = _readings(list(pairs))
    if readings is None:
        return None
    sums = np.zeros((len(readings), joints.shape[1] + opens.shape[1]))
    for k, reading in enumerate(readings):
        joined = [end for pair in reading for end in pair]
        lonely = [end for place, end in enumerate(members) if place not in joined]
        sums[k, : joints.shape[1]] = joints[[pairs[pair] for pair in reading]].sum(axis=0)
        sums[k, joints.shape[1] :] = opens[lonely].sum(axis=0)
    return Choice(source, sums, [set(reading) for reading in readings].index(true))


def _readings(pairs: list[tuple[int, int]]) -> list[tuple[tuple[int, int], ...]] | None:
    """List all matchings of ends by some pairs; None if there are too many."""
    found: list[tuple[tuple[int, int], ...]] = [()]
    for pair in pairs:
        found += [(*reading, pair) for reading in found if not any(end in pair for other in reading for end in other)]
        if len(found) > _MAX_READINGS:
            return None
    return found
