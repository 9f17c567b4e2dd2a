"""Names of recordings of ROS, which the room `ros` reads."""

from __future__ import annotations

import os
from pathlib import Path

BAG_SUFFIXES = (".mcap", ".db3", ".bag")
COMPRESSED = ".zstd"
"""Suffix behind that of a file that rosbag2 compressed as a whole."""
_ACTIVE = ".active"
METADATA = "metadata.yaml"
"""File in the folder of a rosbag2 that lists its files."""


def is_recording(path: Path) -> bool:
    """Return True for a file that has the name of a recording, and for a folder that holds one, of rosbag2."""
    if not os.path.isdir(path):
        return is_recording_file(path)
    return os.path.isfile(os.path.join(path, METADATA)) or bool(files_in(path))


def files_in(folder: Path) -> list[Path]:
    """Return the files of recordings in a folder; none where it cannot be listed."""
    try:
        names = os.listdir(folder)
    except OSError:
        return []
    return [folder / name for name in names if is_recording_file(Path(name)) and not name.startswith(".")]


def is_active(path: Path) -> bool:
    """Return True for a bag of ROS 1 that its recorder did not finish: it is then named ``NAME.bag.active``."""
    return path.suffix.lower() == _ACTIVE and path.stem.lower().endswith(".bag")


def is_recording_file(path: Path) -> bool:
    """Return True for the name of a file of a recording."""
    whole = path.with_suffix("") if path.suffix.lower() == COMPRESSED else path
    return whole.suffix.lower() in BAG_SUFFIXES or is_active(path)
