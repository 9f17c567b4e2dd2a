"""The part of `benchmarks.constants` that runs in a process of its own, on a copy of the tree with a constant changed.

It writes some frames of each generated kind once, or reads them and writes, a line a kind, the digest of all results.
"""

from __future__ import annotations

import hashlib
import pickle
import sys
from pathlib import Path
from typing import Any

import msgspec

import dloftbs
from benchmarks.digests_run import add

_SIZE = (240, 426)
_FRAMES = {
    "demo": 40,
    "tracking": 120,
    "known-occluders": 120,
    "seen-occluders": 120,
    "plain-sight": 80,
    "rgb": 20,
    "rgbd": 30,
    "rgbd-noisy": 30,
    "several-cables": 62,
    "kinds": 48,
    "edge-cases": 24,
    "noise": 6,
    "harness": 12,
}
"""Number of frames of each kind at least; whole sequences. First what the most constants change."""

_SCALE = 2e-3
_SCALES = {"several-cables": 1.0, "kinds": 0.02}  # rare decisions

_CONFIGS = ((dloftbs.Config(), True), (dloftbs.Config(linking=dloftbs.config.LinkingConfig(objects=2)), False))
_CONFIGS_OF = {"harness": ((dloftbs.Config(linking=dloftbs.config.LinkingConfig(branched=True)), True),)}


def write(path: Path) -> None:
    """Generate the frames: for each kind its sequences, each with the colours to look for."""
    from dloftbs_lab.evaluation.suites import open_suite
    from dloftbs_lab.synthetic import DemoSequence

    kinds: dict[str, list[tuple[Any, list[dloftbs.Frame]]]] = {}
    for name, least in _FRAMES.items():
        whole = [DemoSequence(frames=least, size=_SIZE, width_px=8.0)] if name == "demo" else None
        sequences = whole or open_suite(name, scale=_SCALES.get(name, _SCALE), size=_SIZE).sequences
        taken = kinds[name] = []
        for sequence in sequences:
            if sum(len(frames) for _, frames in taken) < least:
                taken.append((getattr(sequence, "hsv", ()), list(sequence)))
    path.write_bytes(pickle.dumps(kinds))


def read(path: Path) -> None:
    """Write the digest of what comes out of each kind."""
    for name, sequences in pickle.loads(path.read_bytes()).items():
        digest = hashlib.sha256()
        for hsv, frames in sequences:
            segmentation = dloftbs.config.SegmentationConfig(hsv=hsv)
            for config, tracked in _CONFIGS_OF.get(name, _CONFIGS):
                pipeline = dloftbs.Pipeline(msgspec.structs.replace(config, segmentation=segmentation))
                for frame in frames:
                    result = pipeline.process(frame) if tracked else pipeline.detect(frame)
                    add(digest, result)
                    add(digest, [(one.width_px, one.confidence, one.inferred) for one in result.detections])
        sys.stdout.write(f"{name}\t{digest.hexdigest()}\n")
        sys.stdout.flush()


if __name__ == "__main__":
    {"write": write, "read": read}[sys.argv[1]](Path(sys.argv[2]))
