"""The part of `benchmarks.digests` that runs in a process of its own, on a commit of which it uses the public door.

For every kind of frames it writes a line: the kind, and the digests of its frames and of what each method made of them.
"""

from __future__ import annotations

import hashlib
import importlib
import json
import struct
import sys
from collections.abc import Callable, Iterator, Mapping
from dataclasses import Field, fields, is_dataclass
from enum import Enum
from pathlib import Path
from typing import Any

import numpy as np

import dloftbs

LAB = "dloftbs_lab" if Path(dloftbs.__file__).parents[1].joinpath("dloftbs_lab").is_dir() else "dloftbs"  # once inside
suites: Any = importlib.import_module(f"{LAB}.evaluation.suites")
synthetic: Any = importlib.import_module(f"{LAB}.synthetic")

_SIZE = (240, 426)  # small, so that ten thousand frames take minutes
_MAX_FRAMES = 1500  # of a kind
_FEWER_FRAMES = {"simulated": 200}  # its physics take a tenth of a second a frame
_SCALES = {"several-cables": 6.0}  # single images: 62 of them at the scale of the paper
_QUICK_FRAMES = 6
_TIMES = "stage_ms"  # of a result: differ from run to run

CONFIGS: dict[str, tuple[dloftbs.Config, bool]] = {
    "default": (dloftbs.Config(), True),
    "default, frame by frame": (dloftbs.Config(), False),
    "default, 2 objects": (dloftbs.Config(linking=dloftbs.config.LinkingConfig(objects=2)), False),
    "published": (dloftbs.Config.paper(), True),
    "published, 1 object": (dloftbs.Config.paper(objects=1), True),
}
"""From the name of a method to its configuration, and whether its frames are tracked."""


def main(names: list[str], *, quick: bool) -> None:
    """Write the digests of the kinds named, or of all whose needs are there."""
    for name in names or [*(name for name in suites.SUITES if suites.missing_for(name) is None), "demo"]:
        sys.stdout.write(json.dumps({"kind": name, **digests_of(sequences_of(name, quick))}) + "\n")
        sys.stdout.flush()


def sequences_of(name: str, quick: bool) -> Iterator[Any]:
    """Yield sequences, spread over all of a suite: whole ones, since tracks are made of their frames in order."""
    if name == "demo":
        yield synthetic.DemoSequence(frames=_QUICK_FRAMES if quick else 90, size=_SIZE, width_px=8.0)
        return
    scale = 1e-3 if quick else _SCALES.get(name, 1.0)
    suite = suites.open_suite(name, scale=scale, size=_SIZE)
    most = _QUICK_FRAMES if quick else _FEWER_FRAMES.get(name, _MAX_FRAMES)
    share, taken = min(1.0, most / suite.frames), 0
    for number, sequence in enumerate(suite.sequences, start=1):
        if taken < share * number:
            taken += 1
            yield sequence


def digests_of(sequences: Iterator[Any]) -> dict[str, Any]:
    """Return the number of frames, the digest of what goes in, and that of what comes out by each method."""
    count, given = 0, hashlib.sha256()
    made = {name: hashlib.sha256() for name in CONFIGS}
    for sequence in sequences:
        methods = {name: _method(*how, getattr(sequence, "hsv", ())) for name, how in CONFIGS.items()}
        for frame in sequence:
            count += 1
            add(given, frame)
            for name, method in methods.items():
                result = method(frame)
                add(made[name], result)
                add(made[name], [(one.width_px, one.confidence, one.inferred) for one in result.detections])
    return {"frames": count, "given": given.hexdigest(), **{name: one.hexdigest() for name, one in made.items()}}


def _method(config: dloftbs.Config, tracked: bool, hsv: Any) -> Callable[[dloftbs.Frame], dloftbs.FrameResult]:
    pipeline = dloftbs.Pipeline(config, hsv=hsv)
    return pipeline.process if tracked else pipeline.detect


def add(digest: Any, value: Any) -> None:
    """Add a value to a digest, to the last bit: its parts in order, by what they are and not by their names."""
    match value:
        case None | bool() | int() | str():
            digest.update(f"{value!r};".encode())
        case Enum():
            digest.update(f"member {list(type(value)).index(value)};".encode())
        case float():
            digest.update(struct.pack("<d", value))
        case np.ndarray():
            digest.update(f"{value.dtype.str}{value.shape};".encode() + np.ascontiguousarray(value).tobytes())
        case dloftbs.BSplineCurve():
            add(digest, (value.knots, value.control_points, value.degree, value.closed))
        case Mapping():
            add(digest, tuple(value.values()))
        case tuple() | list():
            digest.update(f"{len(value)} parts;".encode())
            for part in value:
                add(digest, part)
        case _ if is_dataclass(value):
            held = ((one, getattr(value, one.name)) for one in fields(value) if one.name != _TIMES)
            add(digest, tuple(part for one, part in held if not _is_left_out(one, part)))
        case _:
            raise TypeError(f"no digest of {type(value).__name__}")


def _is_left_out(one: Field[Any], part: Any) -> bool:
    """Return whether a field holds nothing, as it does by default: one that is new is then no other result."""
    return _is_nothing(part) and (one.default_factory is tuple or _is_nothing(one.default))


def _is_nothing(value: Any) -> bool:
    return value is None or (isinstance(value, tuple) and all(map(_is_nothing, value)))


if __name__ == "__main__":
    if not Path(dloftbs.__file__).is_relative_to(Path(sys.argv[1]).resolve()):
        sys.exit(f"{dloftbs.__file__} is not of {sys.argv[1]}")
    main(sys.argv[3:], quick=sys.argv[2] == "quick")
