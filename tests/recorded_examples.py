"""A tiny sequence of which everything is known, and files to lay beside each other."""

from __future__ import annotations

from pathlib import Path

import builders
import cv2
import numpy as np

from dloftbs.camera import PinholeCamera
from dloftbs.data.frame import Frame
from dloftbs_lab.known_sequence import KnownSequence
from dloftbs_lab.truth import Truth

SIZE = (31, 45)
"""Rows and columns; odd, since videos are not."""
CAMERA = PinholeCamera(512.25, 511.1, 22.3, 15.7)


class TinySequence(KnownSequence):
    """Two bars that move down, in every kind of array that a frame may hold.

    Parameters
    ----------
    length : int
    mask, depth : numpy.dtype or type, optional
        Types of what the frames hold of the kind; none where left out.
    stop : int, optional
        This frame interrupts whoever asks for it.
    """

    def __init__(self, length=4, mask=bool, depth=np.float32, *, stop=None, images=True):
        self.name, self.length, self.fps = "tiny", length, 12.5
        self._mask, self._depth, self._stop, self._images = mask, depth, stop, images

    def frame(self, index):
        if index == self._stop:
            raise KeyboardInterrupt
        rng = np.random.default_rng(index)
        return Frame(
            image=rng.integers(0, 256, (*SIZE, 3), np.uint8) if self._images else None,
            mask=None if self._mask is None else (self.truth(index).mask * 1).astype(self._mask),
            depth=None if self._depth is None else (rng.normal(900, 90, SIZE) / 7).astype(self._depth),
            camera=CAMERA,
            index=index * 2,
            stamp=index / 12.5,
            name=f"größe {index}",
        )

    def truth(self, index):
        masks = np.zeros((2, *SIZE), np.bool_)
        masks[0, 3 + index, 4:20] = True
        masks[1, 12 + index, 9:40] = True
        curves = (builders.random_curve(index), builders.loop(9.0 + index / 3, (20.1, 12.3)))
        curves_3d = (builders.random_curve(index + 50, ndim=3), builders.random_curve(index + 90, ndim=3, closed=True))
        return Truth(curves, tuple(masks), (5, 2), curves_3d)


def assert_same_truth(got: Truth, wanted: Truth) -> None:
    assert (got.curves, got.ids, got.curves_3d) == (wanted.curves, wanted.ids, wanted.curves_3d)
    assert len(got.visible_masks) == len(wanted.visible_masks)
    for ours, theirs in zip(got.visible_masks, wanted.visible_masks, strict=True):
        assert_same_bits(ours, theirs)


def assert_same_bits(got: np.ndarray | None, wanted: np.ndarray | None) -> None:
    if wanted is None:
        assert got is None
        return
    assert (got.dtype, got.shape) == (wanted.dtype, wanted.shape)
    assert got.tobytes() == wanted.tobytes()


def save(path: Path, pixels: np.ndarray) -> Path:
    path.parent.mkdir(parents=True, exist_ok=True)
    done, data = cv2.imencode(path.suffix, pixels)
    assert done
    path.write_bytes(data.tobytes())
    return path


def picture(seed: int = 0) -> np.ndarray:
    return np.random.default_rng(seed).integers(0, 256, (*SIZE, 3), np.uint8)
