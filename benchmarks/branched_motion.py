"""Real motion of branched cables before a camera of one's own: branch points and branches of single frames.

``python -m benchmarks.branched_motion FILE...`` reads recordings as DEFT's are kept (`markers`, `trunk`, `branches`,
`joints`), projects each from any side to 1280 x 720, draws what is seen 12 px wide, and scores what is read of the mask
alone, for several costs of a branch's end. Frames with a branch point on another branch are left out. ``--sequences N``
follows N whole recordings of each file instead, before cameras that see all of them, and counts changes of ids.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path
from typing import Any, NamedTuple

import cv2
import numpy as np
import numpy.typing as npt
from scipy.interpolate import CubicSpline
from scipy.optimize import linear_sum_assignment
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

import dloftbs
from dloftbs.linking import branch_weights, end_matching

_Floats = npt.NDArray[np.float64]
SIZE, WIDTH_PX, FOCAL_PX = (720, 1280), 12, 900.0
NODE_PX, BRANCH_PX = 10.0, 5.0
_CAMERAS = 60  # that are tried for each recording


class Scene(NamedTuple):
    """Branches of a frame, px, each (n, 2); those of the trunk first, and its branch points (k, 2)."""

    branches: list[_Floats]
    nodes: _Floats


def scenes(path: Path, per_recording: int, seed: int) -> Iterator[Scene]:
    """Yield frames that show all of a branched cable without a branch point on another branch."""
    with np.load(path) as data:
        markers, trunk = data["markers"], int(data["trunk"])
        counts, joints = data["branches"].tolist(), data["joints"].tolist()
    rng = np.random.default_rng(seed)
    for recording in markers:
        turn, distance = Rotation.random(random_state=rng), rng.uniform(0.8, 1.5)
        for frame in np.linspace(0, len(recording) - 1, per_recording).astype(int):
            points = turn.apply(recording[frame] - recording.mean(axis=(0, 1))) + np.array([0.0, 0.0, distance])
            scene = _project(points, trunk, counts, joints)
            if scene is not None and _is_clear(scene):
                yield scene


def sequences(path: Path, count: int, seed: int) -> Iterator[tuple[int, list[Scene]]]:
    """Yield recordings, by number, that a camera shows from end to end in each frame, whatever lies across it."""
    with np.load(path) as data:
        markers, trunk = data["markers"], int(data["trunk"])
        counts, joints = data["branches"].tolist(), data["joints"].tolist()
    rng, left = np.random.default_rng(seed), count
    for number in rng.permutation(len(markers)).tolist():
        recording = markers[number] - markers[number].mean(axis=(0, 1))
        for _ in range(_CAMERAS):
            turn, distance = Rotation.random(random_state=rng), rng.uniform(0.8, 1.5)
            frames = [
                _project(turn.apply(frame) + np.array([0.0, 0.0, distance]), trunk, counts, joints)
                for frame in recording
            ]
            shown = [frame for frame in frames if frame is not None]
            if len(shown) == len(frames):
                left -= 1
                yield number, shown
                break
        if left == 0:
            return


def changes_of_ids(frames: list[Scene]) -> list[int]:
    """Return how often each branch's track has another id than where the branch was last followed, within 10 px."""
    pipeline, last, changes = dloftbs.Pipeline(branched=True), dict[int, int](), [0] * len(frames[0].branches)
    for index, scene in enumerate(frames):
        frame = dloftbs.Frame(mask=mask_of(scene), mask_is="binary", index=index, stamp=0.03 * index)
        tracks = pipeline.process(frame).tracks
        away = np.array([[_distance(track.curve, line) for line in scene.branches] for track in tracks])
        for i, j in zip(*linear_sum_assignment(away), strict=True) if tracks else ():
            if away[i, j] <= NODE_PX:
                changes[j] += last.get(j, tracks[i].id) != tracks[i].id
                last[j] = tracks[i].id
    return changes


def _distance(curve: dloftbs.BSplineCurve, line: _Floats) -> float:
    points = curve(np.linspace(0.0, 1.0, 50))
    return float(0.5 * (cKDTree(line).query(points)[0].mean() + cKDTree(points).query(line)[0].mean()))


def _project(points: _Floats, trunk: int, counts: list[int], joints: list[int]) -> Scene | None:
    if points[:, 2].min() < 0.3:
        return None
    lines, places = [], np.linspace(0.0, 1.0, 200)
    axis = CubicSpline(np.arange(trunk), points[:trunk])
    edges = [0, *sorted(joints), trunk - 1]
    for low, high in pairwise(edges):
        lines.append(axis(low + (high - low) * places))
    at = trunk
    for count, joint in zip(counts, joints, strict=True):
        own = np.concatenate((points[joint][None], points[at : at + count]))
        lines.append(CubicSpline(np.arange(len(own)), own)((len(own) - 1) * places))
        at += count
    flat = [line[:, :2] / line[:, 2:] * FOCAL_PX + (SIZE[1] / 2, SIZE[0] / 2) for line in lines]
    everything = np.concatenate(flat)
    if (everything < 8).any() or (everything > (SIZE[1] - 8, SIZE[0] - 8)).any():
        return None
    return Scene(flat, points[joints][:, :2] / points[joints][:, 2:] * FOCAL_PX + (SIZE[1] / 2, SIZE[0] / 2))


def _is_clear(scene: Scene) -> bool:
    for node in scene.nodes:
        for line in scene.branches:
            near = np.hypot(*(line - node).T) < 2.5 * WIDTH_PX
            meets = min(np.hypot(*(line[k] - node)) for k in (0, -1)) < 1.0
            if near.any() and not (meets and (near[:100].all() or not near[60:140].any())):
                return False
    return True


def mask_of(scene: Scene) -> npt.NDArray[np.uint8]:
    """Return the mask of a scene, 0 and 255."""
    mask = np.zeros(SIZE, np.uint8)
    for line in scene.branches:
        cv2.polylines(mask, [np.rint(line * 16).astype(np.int32)], False, (255,), WIDTH_PX, cv2.LINE_8, 4)
    return mask


def score(scene: Scene, result: dloftbs.FrameResult) -> tuple[int, int, int, int, bool]:
    """Return the branch points that are right, found and true, the right branches, and whether all is right."""
    found = np.array([point.position for point in result.branch_points]).reshape(-1, 2)
    table = np.hypot(*(found[:, None] - scene.nodes).transpose(2, 0, 1))
    rows, columns = linear_sum_assignment(np.where(table <= NODE_PX, table, 1e6))
    right_nodes = int((table[rows, columns] <= NODE_PX).sum())
    cost = np.full((len(result), len(scene.branches)), 1e3)
    for i, one in enumerate(result):
        points = one.curve(np.linspace(0.0, 1.0, 100))
        for j, line in enumerate(scene.branches):
            there, back = cKDTree(line).query(points)[0], cKDTree(points).query(line)[0]
            cost[i, j] = 0.5 * (there.mean() + back.mean()) + (max(there.max(), back.max()) > 2 * NODE_PX) * 1e2
    rows, columns = linear_sum_assignment(cost)
    right = int((cost[rows, columns] <= BRANCH_PX).sum())
    whole = right == len(scene.branches) == len(result) and right_nodes == len(found) == len(scene.nodes)
    return right_nodes, len(found), len(scene.nodes), right, whole


def main() -> None:
    """Score files for several costs."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("files", type=Path, nargs="+")
    parser.add_argument("--frames", type=int, default=2, help="frames a recording")
    parser.add_argument("--costs", type=float, nargs="*", default=[branch_weights.BRANCH_END])
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--sequences", type=int, default=0, help="recordings of each file whose ids are counted")
    options = parser.parse_args()
    for path in options.files:
        for number, frames in sequences(path, options.sequences, options.seed) if options.sequences else ():
            print(f"{path.stem} {number}: changes of ids of each branch {changes_of_ids(frames)}", flush=True)
        if options.sequences:
            continue
        shown = list(scenes(path, options.frames, options.seed))
        for cost in options.costs:
            module: Any = end_matching
            module.BRANCH_END = cost
            rows = []
            for scene in shown:
                rows.append(score(scene, dloftbs.detect(mask_of(scene), branched=True, mask_is="binary")))
            right, found, true, branches, whole = np.array(rows).sum(axis=0)
            share = branches / sum(len(scene.branches) for scene in shown)
            print(f"{path.stem} cost {cost:g}: {len(shown)} frames, node F1 {2 * right / (found + true):.3f}, "
                  f"branches right {share:.3f}, whole {whole / len(shown):.3f}", flush=True)  # fmt: skip


if __name__ == "__main__":
    main()
