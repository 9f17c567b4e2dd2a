"""Features of pixels on cables, beside them and elsewhere, and the text that keeps them."""

from __future__ import annotations

import base64
import binascii
import struct
import zlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import product

import cv2
import numpy as np
import numpy.typing as npt

from dloftbs.config import Stroke
from dloftbs.data.frame_region import Region
from dloftbs.errors import ConfigError
from dloftbs.segmentation import canonical, log_colours
from dloftbs.segmentation.colour_samples import pixels_of
from dloftbs.segmentation.kernels.pixel_features import COUNT
from dloftbs.segmentation.stroke_widths import CableAxis, cables_beneath
from dloftbs.support.values import shown

_MOST = 1200, 400, 400, 2400
"""Most samples of cables, of strokes on ground, of the ground beside cables, and of the rest of a picture.

Source: bounds memory; a picture takes up to 60 kB of text.
"""
_ROUGH_PX = 8.0
"""Width of cables in the blurred picture in which the colour has to find them, px.

Source: by hand; their borders are a quarter of them then, as mixed as in a picture that is slightly out of focus.
"""
_HEAD = "<d7I"


@dataclass(frozen=True, eq=False)
class PixelSample:
    """Features of some pixels of a picture.

    Parameters
    ----------
    width_px : float
        Width of the cables in the picture.
    kinds : tuple of four numpy.ndarray, shape (f, n), uint8
        Features of pixels on cables, beneath strokes on ground, beside cables, and elsewhere.
    colours : tuple of three numpy.ndarray, shape (n, 3), uint8
        BGR of pixels on cables that are resized and blurred, on cables as they are, and beside the former.
    """

    width_px: float
    kinds: tuple[npt.NDArray[np.uint8], ...]
    colours: tuple[npt.NDArray[np.uint8], ...]

    @classmethod
    def of(
        cls,
        image: npt.NDArray[np.uint8],
        strokes: Sequence[Stroke],
        region: Region | None = None,
        share: float = 1.0,
        axes: Mapping[Stroke, CableAxis | None] | None = None,
        width_px: float | None = None,
    ) -> PixelSample | None:
        """Take samples of a picture with strokes; None where none shows the width of a cable, or nothing is left of it.

        Parameters
        ----------
        image : numpy.ndarray, shape (H, W, 3), uint8
        strokes : sequence of Stroke
        region : Region, optional
            Only pixels of it are elsewhere.
        share : float
            Of the largest number of samples.
        axes : mapping, optional
            Of the cables beneath the strokes, as `cables_beneath` takes them.
        width_px : float, optional
            Width of the cables in other pictures, for one whose strokes are on ground alone.
        """
        found = cables_beneath(image, strokes, axes)
        if width_px is not None and not any(stroke.cable for stroke in strokes):
            found = found._replace(width_px=width_px)
        if not found.width_px > 0.0:
            return None
        ground = pixels_of(image.shape[:2], [stroke for stroke in strokes if not stroke.cable])
        within = np.ones(ground.shape, np.bool_) if region is None else region.paste(np.ones(region.size, np.bool_)) > 0
        kinds: list[list[npt.NDArray[np.uint8]]] = [[] for _ in _MOST]
        shifts = list(product((0.0, 0.5), repeat=2))  # half a pixel: a short stroke gives four times as many samples
        for across, down in shifts:
            step = canonical.shrinking(found.width_px)
            part = slice(round(down * step), None), slice(round(across * step), None)
            small = canonical.resized(np.ascontiguousarray(image[part]), found.width_px)
            cable, refused, beside, inside = (
                _shrunk(where[part], small.shape[1::-1]) for where in (found.cable, ground, found.beside, within)
            )
            masks = cable, refused, beside, inside & ~(cable | refused | beside)
            for kind, where, most in zip(kinds, masks, _MOST, strict=True):
                pixels = np.flatnonzero(where)
                some = np.random.default_rng(0).permutation(len(pixels))[: max(1, int(share * most) // len(shifts))]
                kind.append(canonical.features_of(small, pixels[np.sort(some)]))
        if not any(part.size for kind in kinds[:2] for part in kind):
            return None
        rough = cv2.GaussianBlur(canonical.resized(image, found.width_px, _ROUGH_PX), (3, 3), 0)
        on_cable, next_to = (_shrunk(where, rough.shape[1::-1]) for where in (found.cable, found.beside))
        colours = []
        for picture, where in ((rough, on_cable), (image, found.cable), (rough, next_to)):
            pixels = np.flatnonzero(where)
            some = pixels[:: max(1, -(-len(pixels) // max(1, int(share * _MOST[1]))))]
            colours.append(np.asarray(picture, np.uint8).reshape(-1, 3)[some])
        return cls(found.width_px, tuple(np.concatenate(kind, axis=1) for kind in kinds), tuple(colours))

    @property
    def shows_cables(self) -> bool:
        """True if there are samples of cables: else strokes are on ground alone."""
        return self.kinds[0].shape[1] > 0

    def thinned(self, share: float) -> PixelSample:
        """Return samples of which a share of the largest number is kept at most, evenly over all of a kind."""
        kinds = tuple(
            kind[:, _evenly(kind.shape[1], share, most)] for kind, most in zip(self.kinds, _MOST, strict=True)
        )
        return PixelSample(
            self.width_px, kinds, tuple(colours[_evenly(len(colours), share, _MOST[1])] for colours in self.colours)
        )

    def cells_of_cables(self) -> npt.NDArray[np.int32]:
        """Return the flat number of the cell of colours of each sample on a cable, shape (n,)."""
        return _cells(self.kinds[0])

    def shares_in(self, cells: npt.NDArray[np.bool_]) -> tuple[float, ...]:
        """Return the shares of the pixels of `colours` whose colour is in cells (64, 64, 64)."""
        found = [cells.ravel()[log_colours.cells_of(colours)] for colours in self.colours]
        return tuple(float(one.sum() / max(one.size, 1)) for one in found)

    def to_text(self) -> str:
        """Return the samples as text that `from_text` reads."""
        counts = [kind.shape[1] for kind in self.kinds] + [len(colours) for colours in self.colours]
        packed = struct.pack(_HEAD, self.width_px, *counts) + b"".join(
            part.tobytes() for part in (*self.kinds, *self.colours)
        )
        return base64.b64encode(zlib.compress(packed, 9)).decode()

    @classmethod
    def from_text(cls, text: str) -> PixelSample:
        """Read what `to_text` wrote.

        Raises
        ------
        ConfigError
            If it is something else.
        """
        try:
            unzip = zlib.decompressobj()
            packed = unzip.decompress(base64.b64decode(text, validate=True), _MAX_BYTES)
            width_px, *counts = struct.unpack_from(_HEAD, packed)
            rows = np.array([COUNT] * len(_MOST) + [3, 3, 3])
            size = _START + int(rows @ counts)
            if not (unzip.eof and 0.0 < width_px < 1e6 and any(counts[:2]) and len(packed) == size):
                raise ValueError("of another size")
        except (binascii.Error, ValueError, zlib.error, struct.error) as error:
            raise ConfigError(f"cannot read the samples of pixels {shown(text)}: draw the strokes again") from error
        at, parts = _START, []
        for row, count in zip(rows.tolist(), counts, strict=True):
            parts.append(np.frombuffer(packed, np.uint8, row * count, at))
            at += row * count
        kinds = tuple(part.reshape(COUNT, -1) for part in parts[: len(_MOST)])
        return cls(width_px, kinds, tuple(part.reshape(-1, 3) for part in parts[len(_MOST) :]))


def _evenly(count: int, share: float, most: int) -> npt.NDArray[np.intp]:
    """Return which of some samples are kept where a share of the largest number may be."""
    kept = min(count, max(1, int(share * most)))
    return np.linspace(0, count - 1, kept).round().astype(np.intp)


def _shrunk(where: npt.NDArray[np.bool_], size: tuple[int, ...]) -> npt.NDArray[np.bool_]:
    """Return which pixels of a resized picture are set for the most part."""
    plane = cv2.resize(where.astype(np.uint8) * np.uint8(255), size, interpolation=cv2.INTER_AREA)
    return np.asarray(plane >= 128)


def _cells(kind: npt.NDArray[np.uint8]) -> npt.NDArray[np.int32]:
    """Return the cells of the colours of samples, shape (n,): their first three features are the colour."""
    if not kind.shape[1]:
        return np.zeros(0, np.int32)
    lab = np.ascontiguousarray(kind[:3].T[None])
    return log_colours.cells_of(np.asarray(cv2.cvtColor(lab, cv2.COLOR_LAB2BGR), np.uint8)[0])


_START = struct.calcsize(_HEAD)
_MAX_BYTES = _START + COUNT * sum(_MOST) + 3 * 3 * _MOST[1] + 1
"""Length of unpacked samples that are read at most, bytes.

Source: derived.
"""
