"""Curves in space from two cameras: how far they are off, whether their deviations hold, which cables are mixed up.

Run it in the repository with ``python -m benchmarks.stereo [--motion FOLDER] [--scenes N] [--seed N]``. It prints the
table of docs/two-cameras.md: by baseline and distance, with an exact rig and one that is wrong, and for several cables.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterable
from dataclasses import dataclass, field
from pathlib import Path
from time import process_time

import numpy as np
import numpy.typing as npt
from scipy.interpolate import CubicSpline
from scipy.spatial import cKDTree

from benchmarks.stereo_scenes import (
    FPS,
    Points,
    TwoViews,
    disturbed,
    drawn_views,
    real_motion_views,
    shifted,
    simulated_views,
)
from dloftbs import CameraRig, Detection, Frame, Pipeline, RigResult, StereoPipeline

MOTION = Path(__file__).parents[2] / "shared/data/motion"
TIMES_S = (0.5, 1.3, 2.1, 2.9, 3.7)
KNOWN_M = 0.003
"""Stated deviation up to which a place counts as known."""
_SAMPLES = 101
_LEAD = 4
"""Moments of a stream before the one that is measured."""
_FINER = 10
"""Points on the true axis for each that it was drawn with, so that the next one is near enough."""


@dataclass
class Score:
    """Errors of curves in space."""

    frames: list[float] = field(default_factory=list)
    ratios: list[npt.NDArray[np.float64]] = field(default_factory=list)
    known: list[float] = field(default_factory=list)
    right: int = 0
    wrong: int = 0
    missed: int = 0
    times: list[float] = field(default_factory=list)

    def row(self) -> str:
        """Return the errors as cells of a table."""
        if not self.frames:
            return "none"
        ratios = np.concatenate(self.ratios)
        within = (100.0 * float((ratios < most).mean()) for most in (1.0, 2.0))
        cells = [
            f"{np.median(self.frames):.2f}",
            f"{np.percentile(self.frames, 95):.2f}",
            f"{100.0 * float(np.mean(self.known)):.0f}",
            *(f"{share:.0f}" for share in within),
            f"{self.right}",
            f"{self.wrong}",
            f"{self.missed}",
            f"{float(np.median(self.times)):.2f}",
        ]
        return " | ".join(cells)


HEADER = (
    "off, mm | 95 %, mm | known, % | within 1, % | within 2, % | right pairs | wrong pairs | not in space | "
    "times a view"
)


def owner_of(detection: Detection, owners: npt.NDArray[np.intp]) -> tuple[int, float]:
    """Return the cable that most pixels under a centre line are of, and their share."""
    columns, rows = np.rint(detection.centerline.points).astype(np.intp).T
    height, width = owners.shape
    under = owners[np.clip(rows, 0, height - 1), np.clip(columns, 0, width - 1)]
    counts = np.bincount(under[under >= 0], minlength=1)
    return int(counts.argmax()), float(counts.max()) / max(int(counts.sum()), 1)


def finely(axis: Points) -> Points:
    """Return an axis with more points."""
    places = np.arange(len(axis))
    found: Points = CubicSpline(places, axis)(np.linspace(0.0, len(axis) - 1, _FINER * len(axis)))
    return found


def add_scene(
    score: Score,
    scene: TwoViews,
    rng: np.random.Generator,
    rotation_deg: float,
    pixel: float,
    apart_s: float,
    lead: int,
) -> None:
    """Look at a scene at some moments, with a rig that is wrong by errors of these standard deviations.

    The second view is taken so much later, seconds. A stream has so many moments before each, and stamps.
    """
    cameras = [shifted(camera, pixel, rng) for camera in scene.cameras]
    poses = [np.eye(4), disturbed(scene.second, rotation_deg, rng)]
    rig = CameraRig(cameras, poses, rotation_std_deg=rotation_deg, pixel_std=pixel)
    pipeline = Pipeline()
    for time_s in TIMES_S:
        views = [scene.mask(0, time_s), scene.mask(1, time_s + apart_s)]
        masks = [mask for mask, _ in views]
        result = in_stream(rig, scene, time_s, apart_s, lead) if lead else rig.detect(masks)
        since = process_time()
        for mask in masks:
            pipeline.detect(mask)
        alone = process_time() - since
        since = process_time()
        rig.detect(masks)
        score.times.append(2.0 * (process_time() - since) / alone)
        axes = scene.axes(time_s)
        off = []
        for one in result:
            if one.curve_3d is None or None in one.members:
                score.missed += one.members[0] is not None
                continue
            owners = [
                owner_of(result.views[view][member], owner)
                for view, (member, (_, owner)) in enumerate(zip(one.members, views, strict=True))
                if member is not None
            ]
            if min(share for _, share in owners) > 0.9:
                same = owners[0][0] == owners[1][0]
                score.right, score.wrong = score.right + same, score.wrong + (not same)
            u = np.linspace(0.0, 1.0, _SAMPLES)
            apart, _ = cKDTree(finely(axes[owners[0][0]])).query(one.curve_3d(u))
            std = one.curve_3d_std(u)
            known = std < KNOWN_M
            score.known.append(float(known.mean()))
            score.ratios.append(apart / std)
            if known.any():
                off.append(1e3 * float(apart[known].mean()))
        if off:
            score.frames.append(float(np.mean(off)))


def in_stream(rig: CameraRig, scene: TwoViews, time_s: float, apart_s: float, lead: int) -> RigResult:
    """Return what a pipeline sees of a moment after some earlier ones."""
    pipeline = StereoPipeline(rig)
    for number in range(lead, -1, -1):
        stamps = [time_s - number / FPS + late for late in (0.0, apart_s)]
        result = pipeline.process([Frame(mask=scene.mask(view, at)[0], stamp=at) for view, at in enumerate(stamps)])
    return result


def measure(
    scenes: Iterable[TwoViews],
    seed: int,
    rotation_deg: float = 0.0,
    pixel: float = 0.0,
    apart_s: float = 0.0,
    lead: int = 0,
) -> Score:
    """Return the errors over scenes."""
    score = Score()
    rng = np.random.default_rng(seed)
    for scene in scenes:
        add_scene(score, scene, rng, rotation_deg, pixel, apart_s, lead)
    return score


def main() -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--motion", type=Path, default=MOTION)
    parser.add_argument("--scenes", type=int, default=12)
    parser.add_argument("--seed", type=int, default=500)
    given = parser.parse_args()
    seeds = range(given.seed, given.seed + given.scenes)
    print(f"| scene | {HEADER} |")
    print("| --- |" + " ---: |" * (HEADER.count("|") + 1))
    for baseline_m, distance_m in ((0.06, 0.8), (0.3, 0.8), (0.06, 0.4), (0.12, 0.8), (0.12, 1.5), (0.3, 1.5)):
        real = [real_motion_views(given.motion, seed, baseline_m=baseline_m, distance_m=distance_m) for seed in seeds]
        name = f"{1e3 * baseline_m:.0f} mm, {distance_m} m"
        print(f"| {name} | {measure(real, given.seed).row()} |", flush=True)
    for baseline_m in (0.06, 0.3):
        real = [real_motion_views(given.motion, seed, baseline_m=baseline_m) for seed in seeds]
        name = f"{1e3 * baseline_m:.0f} mm, 0.8 m"
        print(f"| {name}, rig off by 0.1 degree and 0.2 px | {measure(real, given.seed, 0.1, 0.2).row()} |", flush=True)
        print(f"| {name}, 5 ms apart | {measure(real, given.seed, apart_s=0.005).row()} |", flush=True)
        for apart_s in (0.005, 0.012):
            score = measure(real, given.seed, apart_s=apart_s, lead=_LEAD)
            print(f"| {name}, {1e3 * apart_s:.0f} ms apart, a stream with stamps | {score.row()} |", flush=True)
        moved = [simulated_views(seed, baseline_m=baseline_m) for seed in seeds]
        print(f"| {name}, simulated | {measure(moved, given.seed).row()} |", flush=True)
        score = measure(moved, given.seed, apart_s=0.005, lead=_LEAD)
        print(f"| {name}, simulated, 5 ms apart, a stream with stamps | {score.row()} |", flush=True)
        drawn = [drawn_views(seed, baseline_m=baseline_m) for seed in seeds]
        print(f"| {name}, drawn | {measure(drawn, given.seed).row()} |", flush=True)
        for cables in (2, 3):
            several = [real_motion_views(given.motion, seed, cables=cables, baseline_m=baseline_m) for seed in seeds]
            print(f"| {name}, {cables} cables | {measure(several, given.seed).row()} |", flush=True)


if __name__ == "__main__":
    main()
