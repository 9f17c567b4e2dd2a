"""Colour image to mask, by colours and the look of cables learned from strokes that somebody drew."""

from __future__ import annotations

import functools
import math
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import msgspec
import numpy as np
import numpy.typing as npt

from dloftbs.config import ColourConfig, ColourPicture, Roi, Stroke
from dloftbs.data.frame_region import Region
from dloftbs.errors import InputError
from dloftbs.segmentation import log_colours
from dloftbs.segmentation.colour_samples import ColourSample
from dloftbs.segmentation.colour_table import LEVELS, ColourTable
from dloftbs.segmentation.pixel_classifier import PixelClassifier
from dloftbs.segmentation.pixel_samples import PixelSample
from dloftbs.segmentation.stroke_widths import CableAxis
from dloftbs.support.arrays import BoolArray, ByteArray, FloatArray, check_image
from dloftbs.support.values import check_all, check_text, check_type, shown

_CABLE_SCALES = ((0.6, 0.25, 0.05), (0.3, 0.40, 0.10), (0.1, 0.50, 0.30))
"""Share, and standard deviations in lightness and in tint, of the kernels that spread a cable's colours: as the light
changes from picture to picture, lightness by a quarter, tint by a twentieth, and now and then by more.

Source: by hand, on cables drawn over the photographs of scikit-image (`python -m benchmarks.segmentation`).
"""
_GROUND_SCALES = ((0.9, 0.20, 0.05), (0.1, 0.40, 0.10))
"""Share and standard deviations, as `_CABLE_SCALES`, of the ground: narrower, since pictures show most of its colours.

Source: by hand, in the same way.
"""
_UNKNOWN = 1e-7
"""Share, for each bin, of colours that no picture showed: they are ground, however far they lie from both.

Source: by hand; ten times more or less changes IoU by 0.01.
"""
_OUTLIERS = 0.3
"""Share of a stroke that may lie beside what it means.

Source: by hand; half of it changes IoU by less than 0.01.
"""
_PRIOR = 0.1
"""Share of a picture that cables cover.

Source: by hand; more than most, since a missing pixel does more harm than one too many.
"""
_PRIOR_LOG_ODDS = math.log(_PRIOR / (1.0 - _PRIOR))
"""The same share as log-odds.

Source: derived.
"""
_FOUND = 0.92
"""Least share of the cables beneath strokes, with their blurred borders, that the colour finds where it alone decides;
twice as much of the ground beside them as may be missing may be found.

Source: measured on three sets of photographs: where others help, the colour finds .91 at most; where not, .93.
"""
_WHOLE_SAMPLES = 2
"""Number of pictures whose samples of pixels are kept as they are; of more, each keeps its share.

Source: bounds memory; a file stays below 200 kB.
"""
_NOT_CABLE = 0.03
"""Weight of the colours beneath strokes on what is no cable, as a share of the ground.

Source: by hand; as many pixels as a cable has in a picture.
"""
_GROWN = 0.3
"""Share of like colours in the rest of the picture, as a multiple of those beneath the strokes.

Source: by hand, as `_CABLE_SCALES`.
"""
_ROUNDS = 2
"""Times that cable and ground are distinguished anew.

Source: by hand; more rounds gain nothing.
"""
_NOTHING = 1e-12
"""Share that is added to each bin.

Source: numerics; logarithms stay finite.
"""


class ColourModel:
    """A callable ``image -> mask``: a pixel is cable where it looks like what lies beneath the strokes.

    Where the colour finds the cables beneath the strokes across their whole width, it alone decides, at the speed of a
    table. Elsewhere a classifier of pixels does, by colour, local contrast and ridges as wide as the cables, and by the
    lines that its probabilities make. `fit` and `fit_many` make one of pictures, and the constructor of what
    `to_config` kept of them: exactly the same.

    Parameters
    ----------
    config : ColourConfig
        Kept by `to_config`.

    Raises
    ------
    ConfigError
        If its samples cannot be read.

    Examples
    --------
    >>> image = np.zeros((60, 90, 3), np.uint8) + np.array([90, 110, 120], np.uint8)
    >>> image[28:33, 10:80] = (40, 30, 200)
    >>> model = ColourModel.fit(image, [Stroke(points=[(20, 30), (60, 30)])])
    >>> int(model(image).sum())
    350
    >>> bool((model.probability(image)[30, 10:80] > 0.5).all())
    True
    """

    def __init__(self, config: ColourConfig) -> None:
        check_type("config", config, ColourConfig)
        self._config = config
        texts = tuple(picture.sample for picture in config.pictures)
        samples = [ColourSample.from_text(text) for text in texts]
        pixels = [PixelSample.from_text(picture.pixels) for picture in config.pictures if picture.pixels]
        log_ratio = _log_ratio_of(texts)
        cells = _is_cable(log_ratio, samples, accept=config.accept_strokes)
        self._table = ColourTable(_colour_bits(cells))
        self._by_colour = _probability(log_ratio, cells)
        self._log_ratio = log_ratio - _PRIOR_LOG_ODDS
        self._shares = [sample.shares_in(cells) for sample in pixels if sample.shows_cables]
        self._pixels: PixelClassifier | None = None
        if self._shares and not config.accept_strokes and not self._colour_will_do():
            self._pixels = PixelClassifier(pixels, self._log_ratio)

    @property
    def by_colour_alone(self) -> bool:
        """True if the colour of each pixel decides, and nothing else of the image."""
        return self._pixels is None

    @property
    def classifier(self) -> PixelClassifier | None:
        """The classifier of pixels that decides, or None."""
        return self._pixels

    def _colour_will_do(self) -> bool:
        """Return whether the colour finds the cables beneath the strokes, and not the ground beside them."""
        blurred, sharp, beside = np.mean(self._shares, axis=0)
        is_found = blurred >= _FOUND or sharp >= 0.5 * (1.0 + _FOUND)  # without blur, half as much may be missing
        return bool(is_found and beside <= 2.0 * (1.0 - _FOUND))

    def __call__(self, image: ByteArray) -> BoolArray:
        """Segment an image.

        Parameters
        ----------
        image : numpy.ndarray, shape (H, W, 3), uint8
            BGR.

        Returns
        -------
        numpy.ndarray, shape (H, W), bool
            True where the probability is one half or more.

        Raises
        ------
        InputError
            If it is no such image.
        """
        if self._pixels is None:
            return self._table(image).view(np.bool_)
        return np.asarray(self.probability(image) >= 0.5)

    def probability(self, image: ByteArray) -> npt.NDArray[np.float32]:
        """Return the probability that each pixel of an image (H, W, 3) is cable, shape (H, W), float32.

        Raises
        ------
        InputError
            If it is no such image.
        """
        image = check_image(image)
        if self._pixels is None or 0 in image.shape:
            return np.asarray(self._by_colour[log_colours.cells_of(image)], np.float32)
        return self._pixels(image)

    def _near(self, image: ByteArray, places: ByteArray) -> BoolArray:
        """Return the mask of an image (H, W, 3) around places, non-zero in (H, W): elsewhere nothing is cable.

        A colour that decides alone decides everywhere: it costs no more.

        Raises
        ------
        InputError
            If it is no such image.
        """
        if self._pixels is None or 0 in image.shape:
            return self(image)
        return np.asarray(self._pixels(check_image(image), places) >= 0.5)

    def colour_log_odds(self, image: ByteArray) -> npt.NDArray[np.float32]:
        """Return the log-odds that the colour of each pixel (H, W, 3) is a cable's, where both are as frequent."""
        return np.asarray(self._log_ratio.ravel()[log_colours.cells_of(check_image(image))])

    @classmethod
    def fit(cls, image: npt.ArrayLike, strokes: Iterable[Stroke], source: str = "") -> ColourModel:
        """Learn the colours of cables from strokes on one picture.

        Parameters
        ----------
        image : array_like, shape (H, W, 3), uint8
            BGR.
        strokes : iterable of Stroke
            On the cables one or more, and on what looks like them and is none.
        source : str
            Origin of the picture, for people.

        Raises
        ------
        InputError
            If the image is none or a stroke leaves it.
        ConfigError
            If no stroke is on a cable.
        """
        return cls.fit_many([(image, strokes, source)])

    @classmethod
    def fit_many(cls, pictures: Iterable[tuple[npt.ArrayLike, Iterable[Stroke], str]]) -> ColourModel:
        """Learn the colours of cables from strokes on several pictures: ``(image, strokes, source)`` each.

        Raises
        ------
        InputError, ConfigError
            As `fit`.
        """
        return cls(ColourConfig(pictures=cls.pictures_of(pictures)))

    @staticmethod
    def pictures_of(
        pictures: Iterable[tuple[npt.ArrayLike, Iterable[Stroke], str]],
        roi: Roi | None = None,
        others: Sequence[ColourPicture] = (),
    ) -> tuple[ColourPicture, ...]:
        """Return what is kept of pictures and strokes, as `fit_many` takes them.

        Where there are no strokes, the colours of a region of interest alone are counted, if there is one. In a picture
        whose strokes are on ground alone, cables would be as wide as in these pictures, and in others of the model.

        Raises
        ------
        InputError
            As `fit`, and if the region does not lie within a picture.
        """
        entries = []
        for entry in _items("pictures", pictures):
            if not isinstance(entry, (tuple, list)) or len(entry) != 3:
                raise InputError(f"each picture must be a tuple (image, strokes, source), got {shown(entry)}")
            image, given, source = entry
            entries.append((check_image(image), _checked_strokes(given), check_text("source", source)))
        share = min(1.0, _WHOLE_SAMPLES / max(len(entries), 1))
        kept: dict[int, ColourPicture] = {}
        for number in sorted(range(len(entries)), key=lambda k: not any(stroke.cable for stroke in entries[k][1])):
            image, strokes, source = entries[number]
            picture = picture_of(image, strokes, roi, share, width_px=width_in((*others, *kept.values())))
            kept[number] = msgspec.structs.replace(picture, source=source)
        return tuple([kept[number] for number in range(len(entries))])

    @staticmethod
    def together(pictures: Sequence[ColourPicture]) -> tuple[ColourPicture, ...]:
        """Return pictures, learned at different times, as they are kept together: of many, each keeps its share.

        Parameters
        ----------
        pictures : sequence of ColourPicture

        Raises
        ------
        InputError
            If one of them is something else.
        ConfigError
            If samples cannot be read.
        """
        check_all("pictures", pictures, ColourPicture)
        given = tuple(pictures)
        if len(given) <= _WHOLE_SAMPLES:
            return given
        share = _WHOLE_SAMPLES / len(given)
        return tuple(
            msgspec.structs.replace(one, pixels=PixelSample.from_text(one.pixels).thinned(share).to_text())
            if one.pixels
            else one
            for one in given
        )

    def to_config(self) -> ColourConfig:
        """Return the strokes, where they come from, and the colours that they were drawn on."""
        return self._config


def picture_of(
    image: ByteArray,
    strokes: Sequence[Stroke],
    roi: Roi | None = None,
    share: float = 1.0,
    axes: Mapping[Stroke, CableAxis | None] | None = None,
    width_px: float | None = None,
) -> ColourPicture:
    """Return what is kept of a picture (H, W, 3) and strokes on it.

    Parameters
    ----------
    image : numpy.ndarray, shape (H, W, 3), uint8
        BGR.
    strokes : sequence of Stroke
    roi : Roi, optional
        Where there are no strokes, the colours of this region alone are counted.
    share : float
        Of the largest number of samples of pixels.
    axes : mapping, optional
        Of the cables beneath the strokes, as `cables_beneath` takes them.
    width_px : float, optional
        Width of the cables in other pictures, for one whose strokes are on ground alone.

    Raises
    ------
    InputError
        If a stroke leaves the picture, or the region does not lie within it.
    """
    size = int(image.shape[0]), int(image.shape[1])
    region = None if roi is None else Region(roi, size)
    sample = ColourSample.of(image, strokes, region)
    pixels = PixelSample.of(image, strokes, region, share, axes, width_px)
    cable, ground = (tuple(str(one) for one in strokes if one.cable is kind) for kind in (True, False))
    return ColourPicture(
        size=size,
        cable=cable,
        ground=ground,
        sample=sample.to_text(),
        pixels="" if pixels is None else pixels.to_text(),
    )


def width_in(pictures: Iterable[ColourPicture]) -> float | None:
    """Return the mean width in px of the cables in pictures; None where none shows it.

    Raises
    ------
    ConfigError
        If samples cannot be read.
    """
    samples = [PixelSample.from_text(picture.pixels) for picture in pictures if picture.cable and picture.pixels]
    return math.exp(math.fsum(math.log(one.width_px) for one in samples) / len(samples)) if samples else None


def _checked_strokes(strokes: object) -> tuple[Stroke, ...]:
    given = _items("strokes", strokes)
    if not all(isinstance(stroke, Stroke) for stroke in given):
        raise InputError(f"strokes must be a sequence of Stroke, got {shown(strokes)}")
    return given


def _items(name: str, values: object) -> tuple[Any, ...]:
    if not isinstance(values, Iterable):
        raise InputError(f"{name} must be a sequence, got {shown(values)}")
    return tuple(values)


def _is_cable(log_ratio: npt.NDArray[np.float32], samples: Sequence[ColourSample], *, accept: bool) -> BoolArray:
    """Return which cells of colours are cable, shape (64, 64, 64): red, green, blue."""
    cells = log_ratio > 0.0
    if accept:
        drawn, refused = _mean([sample.cable for sample in samples]), _mean([sample.ground for sample in samples])
        cells |= (drawn > refused)[log_colours.cell_bins()].reshape(cells.shape)
    return np.asarray(cells)


def _colour_bits(cells: BoolArray) -> ByteArray:
    """Return the bit of every colour, shape (256 red, 256 green, 32 bytes of 8 blues)."""
    repeat = LEVELS // log_colours.CELLS
    bits = np.packbits(np.repeat(cells, repeat, axis=2), axis=2, bitorder="little")
    return np.ascontiguousarray(np.repeat(np.repeat(bits, repeat, axis=0), repeat, axis=1))


def _probability(log_ratio: npt.NDArray[np.float32], cells: BoolArray) -> npt.NDArray[np.float32]:
    """Return the probability of each cell of colours, at least one half where it is cable, shape (64**3,)."""
    odds = np.where(cells, np.maximum(log_ratio, 0.0), np.minimum(log_ratio, -1e-3)).ravel()
    return np.asarray(1.0 / (1.0 + np.exp(-odds)), np.float32)


@functools.lru_cache(maxsize=4)
def _log_ratio_of(texts: tuple[str, ...]) -> npt.NDArray[np.float32]:
    """Return the log-odds that each cell of colours is cable, shape (64, 64, 64), by samples as text.

    A page asks for the same pictures again and again.
    """
    found = log_colours.at_cells(_log_ratio([ColourSample.from_text(text) for text in texts]))
    found.setflags(write=False)
    return found


def _log_ratio(samples: Sequence[ColourSample]) -> FloatArray:
    """Return the log-odds that each bin's colour is cable, shape (bins,).

    The rest of a picture is ground but for what is likelier cable, and a stroke is what it says but for what is
    likelier something else. Pictures are taken in one after the other: a cable that nobody drew on is known by then.
    """
    drawn = _mean([sample.cable for sample in samples])
    refused = _mean([sample.ground for sample in samples])
    cable, found = _smooth_cable(drawn), np.zeros_like(drawn)
    for number in [*range(1, len(samples)), *[len(samples)] * _ROUNDS]:
        rest = _mean([sample.rest for sample in samples[:number]])
        ground = _smooth_ground(rest * (1.0 - found))
        kept = cable / (cable + _OUTLIERS / (1.0 - _OUTLIERS) * ground)
        cable = _smooth_cable(_share(drawn * kept) + _GROWN * _share(rest * found))
        found = _PRIOR * cable / (_PRIOR * cable + (1.0 - _PRIOR) * ground)
    ground = _smooth_ground(rest * (1.0 - found))
    if refused.any():
        spread = _smooth_ground(refused)
        kept = spread / (spread + _OUTLIERS / (1.0 - _OUTLIERS) * cable)
        ground = (1.0 - _NOT_CABLE) * ground + _NOT_CABLE * _smooth_ground(refused * kept)
    return np.asarray(np.log(_PRIOR * cable) - np.log((1.0 - _PRIOR) * ground))


def _smooth_cable(histogram: FloatArray) -> FloatArray:
    return log_colours.smooth(histogram, _CABLE_SCALES) + _NOTHING


def _smooth_ground(histogram: FloatArray) -> FloatArray:
    return log_colours.smooth(histogram, _GROUND_SCALES) + _UNKNOWN


def _share(histogram: FloatArray) -> FloatArray:
    """Return a histogram that adds up to 1, or to 0 where it counts nothing."""
    return np.asarray(histogram / max(histogram.sum(), _NOTHING))


def _mean(histograms: Sequence[FloatArray]) -> FloatArray:
    """Return the mean of the histograms that count anything, each as shares."""
    shares = [_share(counts) for counts in histograms if counts.any()]
    return np.mean(shares, axis=0) if shares else np.zeros_like(histograms[0])
