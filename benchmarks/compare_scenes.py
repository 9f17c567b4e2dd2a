"""The frames that two commits are compared on: kinds of cables, tracking, depth; as arrays that any commit reads."""

from __future__ import annotations

from itertools import islice
from pathlib import Path

import numpy as np

from benchmarks.scenes import cables
from dloftbs import Frame
from dloftbs_lab.synthetic import (
    NETWORK,
    TYPICAL_NOISE,
    DegradedSequence,
    KindSequence,
    TrackingSequence,
    rgbd_artificial,
)


def write_scenes(folder: Path, *, quick: bool = False) -> list[str]:
    """Write a file for each scene, and return their names."""
    folder.mkdir()
    frames, size = (4, (240, 426)) if quick else (30, (720, 1280))
    scenes: dict[str, list[Frame]] = {}
    for count in (1, 5):
        masks = [cables(count, seed) for seed in range(2 if quick else 4)]
        scenes[f"{count} long cables"] = [Frame(mask=np.roll(mask, 3 * k, axis=0)) for mask in masks for k in range(8)]
    for kind in ("high curvature", "one loop", "five cables"):
        scenes[kind] = list(KindSequence(kind, frames, size))
    scenes["five cables, a network's mask"] = list(DegradedSequence(KindSequence("five cables", frames, size), NETWORK))
    for family, number in (("crossing", 5), ("occluded", 3), ("hidden", 1)):
        scenes[f"tracking: {family}"] = list(TrackingSequence(family, number, frames=frames, size=size))
    depth = rgbd_artificial(0.1, size=size, noise=TYPICAL_NOISE)
    scenes["depth"] = [frame for sequence in depth[:2] for frame in islice(sequence, frames // 2)]
    for name, drawn in scenes.items():
        _write(folder / f"{name}.npz", drawn)
    return list(scenes)


def _write(path: Path, frames: list[Frame]) -> None:
    arrays = {"masks": np.stack([frame.mask for frame in frames if frame.mask is not None])}
    if frames[0].depth is not None and frames[0].camera is not None:
        camera = frames[0].camera
        arrays["depth"] = np.stack([frame.depth for frame in frames if frame.depth is not None])
        arrays["camera"] = np.array([camera.fx, camera.fy, camera.cx, camera.cy])
    stamps = [frame.stamp for frame in frames]
    arrays["stamps"] = np.array([np.nan if stamp is None else stamp for stamp in stamps])
    np.savez_compressed(path, allow_pickle=False, **arrays)
