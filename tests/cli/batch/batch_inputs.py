"""Inputs of a batch, small enough to take no time, and the settings for them."""

import numpy as np
from cli.cli_inputs import mask

from dloftbs.cli.batch.input_list import list_inputs
from dloftbs.cli.batch.settings import BatchSettings
from dloftbs.cli.followed_stream import StreamOptions
from dloftbs.cli.input_options import InputOptions
from dloftbs.config import Config

SIZE = (60, 90)


def stack(path, frames, start=20):
    """Write masks of a cable that moves, and return the path."""
    path.parent.mkdir(parents=True, exist_ok=True)
    np.save(path, np.stack([mask(start + abs(i % 20 - 10), SIZE) for i in range(frames)]))
    return path


def settings(**changes):
    options = {"kind": "auto", "depth": None, "masks": None, "occluders": None}
    inputs = InputOptions(**options, camera=None, registration=None, depth_unit_m=None)
    fields = {"config": Config(), "fps": None, "every": 1, "limit": None}
    given = {name: changes.pop(name, value) for name, value in fields.items()}
    return BatchSettings(StreamOptions(changes.pop("inputs", inputs), **given), **changes)


def only(path, out, suffix=".jsonl"):
    """Return the one input that a path is."""
    (item,) = list_inputs([str(path)], out, suffix)
    return item


def contents(folder):
    """Return the bytes of all results in a folder, and what else lies there by its name alone."""
    files = {path.relative_to(folder).as_posix(): path for path in folder.rglob("*") if path.is_file()}
    return {name: path.read_bytes() if name.endswith(".jsonl") else b"" for name, path in files.items()}
