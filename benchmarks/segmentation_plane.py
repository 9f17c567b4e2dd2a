"""How well the depth above a plane finds cables: round ones that lie on a tilted table, and ones above it.

Run it with ``python -m benchmarks.segmentation_plane [--seeds N]``. Depth has a camera's noise, holes and flying pixels
(`dloftbs_lab.synthetic.depth_noise.TYPICAL_NOISE`), half of it again, and twice; the IoU is that of mask and cable.
"""

from __future__ import annotations

import argparse

import numpy as np
import numpy.typing as npt

import dloftbs
from dloftbs.config import PlaneConfig, SegmentationConfig
from dloftbs.segmentation import make_segmenter
from dloftbs_lab.synthetic.depth_noise import DepthNoise
from dloftbs_lab.synthetic.rgbd_camera import DEPTH_SCENES, DepthCameraSequence
from dloftbs_lab.synthetic.strand import random_strand
from dloftbs_lab.synthetic.tube import footprint

_SIZE = 720, 1280
_DISTANCE_M = 0.7
_FLYING, _HOLES = 0.5, 0.05

Rng = np.random.Generator


def main() -> None:
    """Print a table in Markdown, a row per thickness."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, default=6)
    seeds = range(parser.parse_args().seeds)
    noises = (0.0, 0.5, 1.0, 2.0)
    print("| cable | " + " | ".join(f"noise x {noise:g}" for noise in noises) + " |")
    print("| --- |" + " ---: |" * len(noises))
    for diameter in (0.005, 0.008, 0.012):
        for lift in (0.0, 0.02):
            cells = [
                np.mean([_score(*scene(diameter, lift, noise, seed), diameter) for seed in seeds]) for noise in noises
            ]
            place = f"{1e3 * lift:.0f} mm above" if lift else "on the table"
            print(
                f"| {1e3 * diameter:.0f} mm, {place} | " + " | ".join(f"{cell:.3f}" for cell in cells) + " |",
                flush=True,
            )
    print("\n| scene | errors | IoU |\n| --- | --- | ---: |")
    for kind in DEPTH_SCENES:
        for errors in ("noise", "flying", "all but fattened"):
            sequence = DepthCameraSequence(kind, errors, frames=4)
            found = []
            for index in range(4):
                frame = sequence.frame(index)
                assert frame.mask is not None
                found.append(_score(frame, frame.mask > 0, 0.005))
            print(f"| {kind} | {errors} | {np.mean(found):.3f} |", flush=True)


def _score(frame: dloftbs.Frame, true: npt.NDArray[np.bool_], diameter: float) -> float:
    plane = PlaneConfig(height_m=0.4 * diameter)
    segmenter = make_segmenter(SegmentationConfig(plane=plane))
    assert segmenter is not None
    bare = dloftbs.Frame(image=frame.image, depth=frame.depth, camera=frame.camera)
    found = segmenter(bare) > 0
    return int(np.count_nonzero(found & true)) / max(int(np.count_nonzero(found | true)), 1)


def scene(diameter: float, lift: float, noise: float, seed: int) -> tuple[dloftbs.Frame, npt.NDArray[np.bool_]]:
    """Return a frame of a round cable, in metres, and where it is."""
    rng = np.random.default_rng([seed, round(1e4 * diameter)])
    camera = dloftbs.PinholeCamera(900.0, 900.0, 639.5, 359.5)
    y, x = np.mgrid[: _SIZE[0], : _SIZE[1]]
    slope = rng.normal(0.0, 0.2, 2)
    inverse = (1.0 + slope[0] * (x - camera.cx) / camera.fx + slope[1] * (y - camera.cy) / camera.fy) / _DISTANCE_M
    depth = (1.0 / inverse).astype(np.float32)
    cosine = 1.0 / np.sqrt(1.0 + slope @ slope)
    width_px = diameter * camera.fx / _DISTANCE_M
    strand = random_strand(rng, 900.0, _SIZE, 40.0, 30.0)
    seen = footprint(strand, 0.5 * width_px, _SIZE)
    offset = np.clip(2.0 * seen.offset / width_px, -1.0, 1.0)
    height = lift + 0.5 * diameter * (1.0 + np.sqrt(1.0 - offset**2))
    flat, mask = depth.ravel(), np.zeros(_SIZE, bool)
    top = np.zeros(flat.size)
    np.maximum.at(top, seen.pixel, height)
    mask.ravel()[seen.pixel] = True
    depth = (flat - top / cosine).reshape(_SIZE).astype(np.float32)
    measured = DepthNoise(depth_noise=noise, hole_share=_HOLES, flying=_FLYING).apply(depth, mask, rng)
    image = np.zeros((*_SIZE, 3), np.uint8)
    return dloftbs.Frame(image=image, depth=measured, camera=camera), mask


if __name__ == "__main__":
    main()
