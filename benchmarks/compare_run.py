"""The part of `benchmarks.compare` that runs in a process of its own, on a commit of which it uses as little as it can.

It answers lines on standard input: ``curves SCENE`` with the curves of both methods and their digest, ``times SCENE``
with the milliseconds of all stages.
"""

from __future__ import annotations

import hashlib
import json
import math
import sys
from pathlib import Path
from time import perf_counter
from typing import Any

import numpy as np

import dloftbs

_SAMPLES = 50


def main(folder: Path) -> None:
    """Answer until there are no more questions."""
    answers = {"curves": curves, "times": times}
    for line in sys.stdin:
        what, _, scene = line.strip().partition(" ")
        sys.stdout.write(json.dumps(answers[what](read_frames(folder / f"{scene}.npz"))) + "\n")
        sys.stdout.flush()


def read_frames(path: Path) -> list[dloftbs.Frame]:
    """Read the frames of a scene."""
    with np.load(path) as arrays:
        camera = dloftbs.PinholeCamera(*arrays["camera"].tolist()) if "camera" in arrays else None
        masks, stamps = arrays["masks"], arrays["stamps"].tolist()
        depth = arrays["depth"] if "depth" in arrays else [None] * len(masks)
    return [
        dloftbs.Frame(mask=mask, depth=one, camera=camera, index=index, stamp=None if math.isnan(stamp) else stamp)
        for index, (mask, one, stamp) in enumerate(zip(masks, depth, stamps, strict=True))
    ]


def curves(frames: list[dloftbs.Frame]) -> dict[str, Any]:
    """Return what both methods make of the frames: points on all curves, the tracks' ids, and a digest of every bit."""
    digest, found = hashlib.sha256(), []
    for config in (dloftbs.Config(), dloftbs.Config.paper()):
        pipeline = dloftbs.Pipeline(config)
        for frame in frames:
            result = pipeline.process(frame)
            plain = result.to_dict()
            del plain["stage_ms"]
            digest.update(json.dumps(plain, default=str).encode())
            found_curves = [curve for one in result.detections for curve in (one.curve, one.curve_3d)]
            for curve in [*found_curves, *(curve for one in result.tracks for curve in (one.curve, one.curve_3d))]:
                if curve is not None:
                    digest.update(curve.knots.tobytes() + curve.control_points.tobytes())
            points = [detection.curve.sample(_SAMPLES).tolist() for detection in result.detections]
            found.append({"curves": points, "tracks": [[track.id, track.state.value] for track in result.tracks]})
    return {"digest": digest.hexdigest(), "frames": found}


def times(frames: list[dloftbs.Frame]) -> dict[str, list[float]]:
    """Return the milliseconds of all stages, and of the whole, of every frame."""
    pipeline, paper = dloftbs.Pipeline(), dloftbs.Pipeline(dloftbs.Config.paper())
    stages: dict[str, list[float]] = {"mask to tracked curves": [], "published": []}
    for frame in frames:
        since = perf_counter()
        result = pipeline.process(frame)
        stages["mask to tracked curves"].append(1e3 * (perf_counter() - since))
        for stage, milliseconds in result.stage_ms.items():
            stages.setdefault(stage, []).append(milliseconds)
        since = perf_counter()
        paper.process(frame)
        stages["published"].append(1e3 * (perf_counter() - since))
    return stages


if __name__ == "__main__":
    if not Path(dloftbs.__file__).is_relative_to(Path(sys.argv[2]).resolve()):
        sys.exit(f"{dloftbs.__file__} is not of {sys.argv[2]}")
    main(Path(sys.argv[1]))
