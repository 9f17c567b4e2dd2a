"""Features of pixels on cables, beside them and elsewhere, and the text that keeps them."""

from __future__ import annotations

import base64
import binascii
import struct
import zlib
from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
import numpy.typing as npt

from dloftbs.config import Stroke
from dloftbs.data.frame_region import Region
from dloftbs.errors import ConfigError
from dloftbs.segmentation import canonical, log_colours
from dloftbs.segmentation.colour_samples import pixels_of
from dloftbs.segmentation.kernels.pixel_features import COUNT
from dloftbs.segmentation.stroke_widths import cables_beneath
from dloftbs.support.values import shown

_MOST = 1200, 400, 400, 2400
"""Most samples of cables, of strokes on ground, of the ground beside cables, and of the rest of a picture.

Source: bounds memory; a picture takes up to 60 kB of text.
"""
_HEAD = "<d4I"


@dataclass(frozen=True, eq=False)
class PixelSample:
    """Features of some pixels of a picture.

    Parameters
    ----------
    width_px : float
        Width of the cables in the picture.
    kinds : tuple of four numpy.ndarray, shape (f, n), uint8
        Features of pixels on cables, beneath strokes on ground, beside cables, and elsewhere.
    """

    width_px: float
    kinds: tuple[npt.NDArray[np.uint8], ...]

    @classmethod
    def of(
        cls,
        image: npt.NDArray[np.uint8],
        strokes: Sequence[Stroke],
        log_ratio: npt.NDArray[np.float32],
        region: Region | None = None,
        share: float = 1.0,
    ) -> PixelSample | None:
        """Take samples of a picture with strokes; None where no stroke shows how wide a cable is.

        Parameters
        ----------
        image : numpy.ndarray, shape (H, W, 3), uint8
        strokes : sequence of Stroke
        log_ratio : numpy.ndarray, shape (H, W), float32
            How much likelier each pixel's colour is on a cable than on the ground, as a logarithm.
        region : Region, optional
            Only pixels of it are elsewhere.
        share : float
            Of the largest number of samples.
        """
        found = cables_beneath(log_ratio, strokes)
        if not found.width_px > 0.0:
            return None
        ground = pixels_of(image.shape[:2], [stroke for stroke in strokes if not stroke.cable])
        small = canonical.resized(image, found.width_px)

        def shrunk(where: npt.NDArray[np.bool_]) -> npt.NDArray[np.bool_]:
            plane = cv2.resize(where.view(np.uint8) * np.uint8(255), small.shape[1::-1], interpolation=cv2.INTER_AREA)
            return np.asarray(plane >= 128)

        cable, refused, beside = (shrunk(where) for where in (found.cable, ground, found.beside))
        rest = ~(cable | refused | beside)
        if region is not None:
            rest &= shrunk(region.paste(np.ones(region.size, np.bool_)))
        kinds = []
        for where, most in zip((cable, refused, beside, rest), _MOST, strict=True):
            pixels = np.flatnonzero(where)
            some = np.random.default_rng(0).permutation(len(pixels))[: int(share * most)]
            kinds.append(canonical.features_of(small, pixels[np.sort(some)]))
        return cls(found.width_px, tuple(kinds))

    def cells_of_cables(self) -> npt.NDArray[np.int32]:
        """Return the flat number of the cell of colours of each sample on a cable, shape (n,)."""
        return _cells(self.kinds[0])

    def shares_in(self, cells: npt.NDArray[np.bool_]) -> tuple[float, float]:
        """Return the shares of the samples on cables and beside them whose colour is in cells (64, 64, 64)."""
        cable, beside = (cells.ravel()[_cells(kind)] for kind in (self.kinds[0], self.kinds[2]))
        return float(cable.sum() / max(cable.size, 1)), float(beside.sum() / max(beside.size, 1))

    def to_text(self) -> str:
        """Return the samples as text that `from_text` reads."""
        head = struct.pack(_HEAD, self.width_px, *(kind.shape[1] for kind in self.kinds))
        packed = head + b"".join(kind.tobytes() for kind in self.kinds)
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
            if not (unzip.eof and 0.0 < width_px < 1e6 and counts[0] and len(packed) == _START + COUNT * sum(counts)):
                raise ValueError("of another size")
        except (binascii.Error, ValueError, zlib.error, struct.error) as error:
            raise ConfigError(f"cannot read the samples of pixels {shown(text)}: draw the strokes again") from error
        at, kinds = _START, []
        for count in counts:
            kinds.append(np.frombuffer(packed, np.uint8, COUNT * count, at).reshape(COUNT, count))
            at += COUNT * count
        return cls(width_px, tuple(kinds))


def _cells(kind: npt.NDArray[np.uint8]) -> npt.NDArray[np.int32]:
    """Return the cells of the colours of samples, shape (n,): their first three features are the colour."""
    if not kind.shape[1]:
        return np.zeros(0, np.int32)
    lab = np.ascontiguousarray(kind[:3].T[None])
    return log_colours.cells_of(np.asarray(cv2.cvtColor(lab, cv2.COLOR_LAB2BGR), np.uint8)[0])


_START = struct.calcsize(_HEAD)
_MAX_BYTES = _START + COUNT * sum(_MOST) + 1
"""Length of unpacked samples that are read at most, bytes.

Source: derived.
"""
