"""A sequence with its truth, as a folder that `dloftbs_lab.open_labelled` reads back."""

from __future__ import annotations

import os
from contextlib import closing
from fractions import Fraction
from pathlib import Path
from typing import Any, Protocol

import numpy as np
import numpy.typing as npt

from dloftbs.data.frame import Frame
from dloftbs.errors import InputError
from dloftbs.sinks._images import encode
from dloftbs.sinks._mp4 import H264Mp4
from dloftbs.sinks.sink import identity_of
from dloftbs.support.json_text import encode_line
from dloftbs.support.safe_files import AppendFile, sink_errors, write_whole
from dloftbs.support.text import readable
from dloftbs_lab.known_sequence import KnownSequence
from dloftbs_lab.truth import Truth

HEADER = "sequence.json"
RECORDS = "truth.jsonl"
VIDEO = "images.mp4"
FORMAT = "dloftbs sequence 1"
DEFAULT_FPS = 30.0
"""Of a video, where the sequence has no rate of its own."""
PER_METRE = 1000
"""Depth in PNG is in millimetres."""

AnyArray = npt.NDArray[Any]


class KnownFrames(Protocol):
    """Sequence that can be written: frames by index, each with its truth."""

    name: str
    fps: float | None

    def __len__(self) -> int: ...

    def frame(self, index: int) -> Frame:
        """Return one frame."""

    def truth(self, index: int) -> Truth:
        """Return the truth of one frame."""


def write_sequence(sequence: KnownFrames, folder: str | os.PathLike[str], *, video: bool = False) -> Path:
    """Write a sequence with its truth; `dloftbs_lab.open_labelled` gives the same back, bit for bit.

    ::

        folder/
          sequence.json       name, fps, how many frames there will be
          truth.jsonl         a line per frame: curves, ids, camera, stamp, kind of mask, unit of depth, grippers, files
          images/000000.png   BGR, without loss
          masks/000000.png    .npy where the type is none of bool, uint8 and uint16
          depth/000000.png    uint16 as it is, or metres as 16-bit millimetres where that loses nothing; else .npy
          occluders/          as masks/; instances/ too
          visible/000000.png  which object is seen where: 0 is none, i + 1 the i-th curve

    A frame's line comes after its files. So whatever ends the writing, all frames with a line are whole, and the reader
    says how many there are of how many. An older sequence in the folder is replaced; its surplus files stay, unread.

    Parameters
    ----------
    sequence : KnownSequence
        Or anything else with `name`, `fps`, `__len__`, ``frame(index)`` and ``truth(index)``.
    folder : str or path
        Missing folders are made.
    video : bool
        Write the images as one video, images.mp4 (H.264, which is lossy), in place of images/. All else is exact.

    Returns
    -------
    Path
        The folder.

    Raises
    ------
    InputError
        If the folder is that which the sequence is read from, visible masks overlap or have another size than the
        frame, or a frame for a video has no image or another size than the first.
    SinkError
        If something cannot be written.
    """
    root = Path(folder)
    read = sequence.folder if isinstance(sequence, KnownSequence) else None
    if read is not None and identity_of(root) == identity_of(read):
        raise InputError(f"{str(root)!r} is the folder that the sequence is read from; write it into another one")
    header = {"format": FORMAT, "name": readable(sequence.name), "fps": sequence.fps, "length": len(sequence)}
    records = AppendFile(root / RECORDS)
    try:
        with closing(_Video(root / VIDEO, sequence.fps) if video else _Pictures(root)) as images:
            records.append(b"")  # so that no line of an older sequence ever speaks of new files
            write_whole(root / HEADER, encode_line(header))
            _write_frames(sequence, root, records, images)
    finally:
        records.close()
    return root


def _write_frames(sequence: KnownFrames, root: Path, records: AppendFile, images: _Pictures | _Video) -> None:
    for index in range(len(sequence)):
        frame, truth = sequence.frame(index), sequence.truth(index)
        record = {
            "index": frame.index,
            "stamp": frame.stamp,
            "name": readable(frame.name),
            "size": frame.size,
            "camera": None if frame.camera is None else frame.camera.to_dict(),
            "mask": None if frame.mask is None else _write_mask(root, "masks", index, frame.mask),
            "mask_is": frame.mask_is,
            "depth": None if frame.depth is None else _write_depth(root, index, frame.depth),
            "depth_unit_m": frame.depth_unit_m,
            "occluders": None if frame.occluders is None else _write_mask(root, "occluders", index, frame.occluders),
            "instances": None if frame.instances is None else _write_mask(root, "instances", index, frame.instances),
            "grippers": None if frame.grippers is None else frame.grippers.tolist(),
            "visible": _write_visible(root, index, frame, truth) if truth.visible_masks else None,
            "truth": truth.to_dict(),
            "image": images.add(index, frame),
        }
        records.append(encode_line(record))


class _Pictures:
    """Images in files of their own."""

    def __init__(self, root: Path) -> None:
        self._root = root

    def add(self, index: int, frame: Frame) -> str | None:
        return None if frame.image is None else _save(self._root, "images", index, frame.image, ".png")

    def close(self) -> None:
        """Every file is complete already."""


class _Video:
    """Images in one video."""

    def __init__(self, path: Path, fps: float | None) -> None:
        self._file = AppendFile(path)
        self._rate = Fraction(fps or DEFAULT_FPS).limit_denominator(1001)
        self._video: H264Mp4 | None = None
        self._size: tuple[int, int] | None = None

    def add(self, index: int, frame: Frame) -> str:
        if frame.image is None:
            raise InputError(f"frame {index} has no image, and cannot go into a video; write it with video=False")
        if self._size not in (None, frame.size):
            raise InputError(f"frame {index} must have the first one's size {self._size} in a video, got {frame.size}")
        if self._video is None:
            self._size = frame.size
            self._video = H264Mp4(self._file, frame.size, self._rate, "mp4")
        self._video.add(frame.image)
        return VIDEO

    def close(self) -> None:
        try:
            if self._video is not None:
                self._video.finish()
        finally:
            self._file.close()


def _write_mask(root: Path, folder: str, index: int, mask: AnyArray) -> dict[str, str]:
    pixels = mask * np.uint8(255) if mask.dtype == np.bool_ else mask
    suffix = ".png" if pixels.dtype in (np.uint8, np.uint16) else ".npy"
    return {"file": _save(root, folder, index, pixels, suffix), "type": mask.dtype.str}


def _write_depth(root: Path, index: int, depth: AnyArray) -> dict[str, str]:
    pixels = depth if depth.dtype == np.uint16 else _millimetres(depth)
    if pixels is None:
        return {"file": _save(root, "depth", index, depth, ".npy"), "type": depth.dtype.str}
    return {"file": _save(root, "depth", index, pixels, ".png"), "type": depth.dtype.str}


def _millimetres(depth: AnyArray) -> AnyArray | None:
    """Return metres as 16-bit millimetres, or None where that is not the same depth to the last bit."""
    if not np.issubdtype(depth.dtype, np.floating) or not ((depth >= 0) & (depth <= 65)).all():
        return None
    counts = np.rint(depth * PER_METRE).astype(np.uint16)
    back = (counts / PER_METRE).astype(depth.dtype)
    # By sign too: -0.0 is another bit pattern than 0.0.
    return counts if np.array_equal(back, depth) and not np.signbit(depth).any() else None


def _write_visible(root: Path, index: int, frame: Frame, truth: Truth) -> str:
    count = len(truth.visible_masks)
    labels = np.zeros(frame.size, np.uint8 if count < 256 else np.uint16)
    for number, mask in enumerate(truth.visible_masks, start=1):
        if mask.shape != frame.size:
            raise InputError(f"visible masks of frame {index} must have its size {frame.size}, got {mask.shape}")
        if labels[mask].any():
            raise InputError(f"visible masks of frame {index} overlap, but a pixel shows one object only")
        labels[mask] = number
    return _save(root, "visible", index, labels, ".png")


def _save(root: Path, kind: str, index: int, array: AnyArray, suffix: str) -> str:
    name = f"{kind}/{index:06d}{suffix}"
    path = root / name
    with sink_errors(path):
        path.parent.mkdir(exist_ok=True)
        if suffix == ".npy":
            np.save(path, array)
        else:
            path.write_bytes(encode(array, suffix))
    return name
