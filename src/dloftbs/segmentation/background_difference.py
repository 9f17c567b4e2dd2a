"""For a camera that stands still: the pixels that differ from the place without cables."""

from __future__ import annotations

import logging
import os
from collections.abc import Iterable
from pathlib import Path
from typing import NamedTuple

import cv2
import numpy as np
import numpy.typing as npt

from dloftbs.config import BackgroundConfig
from dloftbs.data.frame import Frame, as_frame
from dloftbs.errors import ConfigError, InputError
from dloftbs.segmentation.contrast import (
    LEVEL,
    SAMPLES,
    SMOOTHING_PX,
    Counts,
    greatest_within,
    limits_of,
    mask_of,
    noise_of,
    pixels_of,
)
from dloftbs.support.arrays import FloatArray, check_image
from dloftbs.support.npy import BROKEN, open_mapped
from dloftbs.support.values import shown

_JITTER = 0.5
"""Movement of a camera that stands still, px.

Source: by hand; a table that somebody touches, and edges that codecs move.
"""
_EDGE_PX = 2
"""Width of the blurred edge of a cable, px.

Source: derived; two standard deviations of the smoothing.
"""
_SHADOW = 1.0 / 40.0
"""Width of the shadow beside a cable, as a share of the shorter side of the image.

Source: by hand; 12 px of 480.
"""
_MAX_NOISE = 4.0
"""Largest noise of a smoothed frame that still shows its background, in levels.

Source: derived; white noise of 20 levels, of a camera at night, leaves a median absolute deviation of 4.
"""
_WHITE = 255
"""Level at which a channel is saturated.

Source: by definition.
"""
_FRAMES = 25
"""Least number of frames that are kept for a median, of as many or more.

Source: derived; their median has a quarter of a frame's noise.
"""

Image = npt.NDArray[np.uint8]

_log = logging.getLogger("dloftbs.segmentation")


class _Place(NamedTuple):
    """The place without cables, smoothed, and the bounds of its trembling pixels, in counts (H, W, 3)."""

    smooth: Counts
    low: Counts
    high: Counts


class BackgroundSegmenter:
    """A callable ``image -> mask`` that compares an image with one of the same place without cables.

    The exposure of the camera may change: each channel is scaled by the median ratio to the background, and what one of
    the two would show as white is compared as white. Where more than
    half of the image differs, the background is one of another place or light, and says nothing: all pixels differ, and
    the logger ``dloftbs.segmentation`` warns once.

    Parameters
    ----------
    background : array_like, shape (H, W, 3), uint8
        BGR, as `median_background` makes it.
    contrast : float, optional
        Least difference, in levels of 255; by default by the noise of the image.

    Raises
    ------
    InputError
        If it is no such image.
    ConfigError
        If the contrast is out of range.
    """

    def __init__(self, background: npt.ArrayLike, contrast: float | None = None) -> None:
        self._contrast = BackgroundConfig(file="-", contrast=contrast).contrast
        self._background = check_image(background).copy()
        if self._background.size == 0:
            raise InputError(f"a background must have pixels, got {self._background.shape}")
        self._place, self._warned = _place_of(_counts_of(self._background)), False
        self._brightest = self._background.max(axis=(0, 1))
        self._per_level = (1.0 / np.maximum(self._place.smooth.max(axis=2), LEVEL)).astype(np.float32)

    def __call__(self, image: npt.NDArray[np.uint8]) -> npt.NDArray[np.uint8]:
        """Return 1 for the pixels that differ from the background, shape (H, W).

        Parameters
        ----------
        image : numpy.ndarray, shape (H, W, 3), uint8
            BGR.

        Raises
        ------
        InputError
            If it is no such image, or of another size than the background.
        """
        image = check_image(image)
        size, expected = image.shape[:2], self._background.shape[:2]
        if size != expected:
            raise InputError(
                f"segmentation.background is {expected[1]} x {expected[0]} px, the frame {size[1]} x {size[0]}: make "
                "it anew from frames of this size (dloftbs background)"
            )
        counts, place = _counts_of(image), self._place
        gain = np.array(_gain(image, self._background))
        if (np.abs(gain - 1.0) > 1.0 / _WHITE).any():  # by a level of the brightest pixel
            counts = _clipped(cv2.multiply(counts, (*(1.0 / gain).tolist(), 0.0)), np.full(3, float(_WHITE)))
            white = np.minimum(_WHITE / gain, _WHITE)  # what a saturated pixel of the image is
            if (self._brightest > white).any():
                place = _place_of(_clipped(_counts_of(self._background), white))
        smooth = _smoothed(counts)
        noise = max(noise_of(*both)[1] for both in zip(_channels(smooth), _channels(place.smooth), strict=True))
        if noise > _MAX_NOISE * LEVEL:
            if not self._warned:
                _log.warning(
                    "segmentation.background shows another place than the frames, or another light: it says nothing. "
                    "Did the camera move? Make it anew (dloftbs background)"
                )
            self._warned = True
            return np.ones(size, np.uint8)
        darker, brighter = cv2.subtract(place.low, smooth), cv2.subtract(smooth, place.high)
        dark, bright = _greatest(darker), _greatest(brighter)
        contrast = np.maximum(dark, bright)
        least, strong = limits_of(0.0, noise, self._contrast)
        pixels = pixels_of(contrast, greatest_within(contrast, _EDGE_PX), least)
        return mask_of(pixels[~self._are_shadow(pixels, dark, bright)], contrast, strong)

    def _are_shadow(self, pixels: npt.NDArray[np.intp], dark: Counts, bright: Counts) -> npt.NDArray[np.bool_]:
        """Return True for pixels (n,) that are darker than the background by less than half of what is beside them.

        A shadow takes the same share of the light from any ground, so shares are compared, not levels.
        """
        reach = max(_EDGE_PX, round(_SHADOW * min(dark.shape)))
        share = dark * self._per_level
        deepest = cv2.dilate(share, np.ones((2 * reach + 1, 2 * reach + 1), np.uint8)).ravel()[pixels]
        brightest = greatest_within(bright, reach).ravel()[pixels]
        level, is_dark = dark.ravel()[pixels], (dark.ravel()[pixels] > bright.ravel()[pixels])
        return np.asarray(is_dark & ((share.ravel()[pixels] < 0.5 * deepest) | (level < brightest // 2)))


def median_background(frames: Iterable[Frame | npt.ArrayLike]) -> Image:
    """Return the median of frames of a camera that stands still, shape (H, W, 3), uint8, BGR.

    A cable is gone where it lies in less than half of the frames; one that rests is part of the background. Of a long
    clip 25 to 50 frames are kept, evenly over all of it.

    Parameters
    ----------
    frames : iterable of Frame or array_like
        Such as a `Source`, or images (H, W, 3); read once.

    Raises
    ------
    InputError
        If there are none, one has no image, or their sizes differ.
    """
    if not isinstance(frames, Iterable) or isinstance(frames, (str, bytes, dict)):
        raise InputError(f"frames must be images, one after the other, or sources.open(path), got {shown(frames)}")
    kept: list[Image] = []
    step = 1
    for number, given in enumerate(frames):
        if number % step:
            continue
        frame = as_frame(given, number)
        if frame.image is None:
            raise InputError(f"a background is made of images, and {frame!r} is a mask")
        if kept and frame.image.shape != kept[0].shape:
            raise InputError(
                f"frames of one background must have one size, got {kept[0].shape[:2]} and {frame.image.shape[:2]}"
            )
        kept.append(frame.image.copy())
        if len(kept) == 2 * _FRAMES:
            kept, step = kept[::2], 2 * step
    if not kept:
        raise InputError("a background is the median of frames, and there are none")
    kept = [_like(kept[len(kept) // 2], image) for image in kept]
    result = np.empty_like(kept[0])
    for row, target in enumerate(result):  # one by one: the memory of all would be a second clip
        some = np.stack([image[row] for image in kept])
        target[:] = np.partition(some, len(kept) // 2, axis=0)[len(kept) // 2]
    return result


def _greatest(counts: Counts) -> Counts:
    """Return the greatest of the channels (H, W) of counts (H, W, 3)."""
    blue, green, red = _channels(counts)
    return np.maximum(np.maximum(blue, green), red)


def _channels(counts: Counts) -> list[Counts]:
    """Return views of the channels (H, W) of counts (H, W, 3)."""
    return [counts[..., channel] for channel in range(counts.shape[2])]


def _like(reference: Image, image: Image) -> Image:
    """Return an image as the exposure of another one would show it."""
    gain = _gain(reference, image)
    return np.asarray(cv2.multiply(image, (*gain, 0.0)), np.uint8)


def _place_of(counts: Counts) -> _Place:
    """Return what is compared of a background in counts (H, W, 3)."""
    smooth, square = _smoothed(counts), np.ones((3, 3), np.uint8)
    low, high = (
        cv2.addWeighted(smooth, 1.0 - _JITTER, beside, _JITTER, 0.0)
        for beside in (cv2.erode(smooth, square), cv2.dilate(smooth, square))
    )
    return _Place(smooth, np.asarray(low, np.int16), np.asarray(high, np.int16))


def _counts_of(image: Image) -> Counts:
    """Return an image in counts, shape (H, W, 3)."""
    return image.astype(np.int16) * np.int16(LEVEL)


def _clipped(counts: Counts, white: FloatArray) -> Counts:
    """Return counts (H, W, 3) no larger than a level of each channel (3,): what a camera shows as white."""
    return np.asarray(np.minimum(counts, np.rint(LEVEL * white).astype(np.int16)))


def _smoothed(counts: Counts) -> Counts:
    return np.asarray(cv2.GaussianBlur(counts, (0, 0), SMOOTHING_PX))


def _gain(image: Image, background: Image) -> tuple[float, ...]:
    """Return the factor of each channel of the background that the exposure of an image asks for."""
    step = max(1, int(np.sqrt(background[..., 0].size / SAMPLES)))
    gains = []
    for now, before in zip(image[::step, ::step].T, background[::step, ::step].T, strict=True):
        usable = (before > 0) & (before < _WHITE) & (now < _WHITE)
        ratios = now[usable] / before[usable].astype(np.float32)
        gain = float(np.median(ratios)) if 2 * ratios.size > before.size else 1.0
        gains.append(gain or 1.0)  # 0 is a black frame
    return tuple(gains)


def read_background(file: str) -> Image:
    """Read a background, shape (H, W, 3), BGR, from a picture or a .npy file.

    Raises
    ------
    ConfigError
        If it cannot be read or is no image of 8 bits.
    """
    path = Path(os.path.expanduser(file))
    try:
        if path.suffix.lower() == ".npy":
            return check_image(open_mapped(path))
        data = np.frombuffer(path.read_bytes(), np.uint8)
        image = cv2.imdecode(data, cv2.IMREAD_COLOR) if data.size else None
    except InputError as error:
        raise ConfigError(f"segmentation.background.file: {path}: {error}") from error
    except BROKEN as error:
        why = getattr(error, "strerror", None) or error
        raise ConfigError(f"segmentation.background.file: cannot read {shown(str(path))}: {why}") from error
    if image is None:
        raise ConfigError(
            f"segmentation.background.file: {path} is no picture; make one of a clip by "
            f"`dloftbs background CLIP --out background.png`"
        )
    return np.asarray(image, np.uint8)
