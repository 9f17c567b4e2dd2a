"""Colour image to mask, by colours learned from strokes that somebody drew."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from dloftbs.config import ColourConfig, ColourPicture, Roi, Stroke
from dloftbs.data.frame_region import Region
from dloftbs.errors import InputError
from dloftbs.segmentation import log_colours
from dloftbs.segmentation.colour_samples import ColourSample
from dloftbs.segmentation.colour_table import LEVELS, ColourTable
from dloftbs.support.arrays import FloatArray, check_image
from dloftbs.support.values import check_text, check_type, shown

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


class ColourModel(ColourTable):
    """A callable ``image -> mask``: a pixel is cable where its colour is likelier beneath the strokes than elsewhere.

    `fit` and `fit_many` make one of pictures, and the constructor of what `to_config` kept of them: exactly the same.

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
    """

    def __init__(self, config: ColourConfig) -> None:
        check_type("config", config, ColourConfig)
        self._config = config
        samples = [ColourSample.from_text(picture.sample) for picture in config.pictures]
        super().__init__(_colour_bits(samples, accept=config.accept_strokes))

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
        pictures: Iterable[tuple[npt.ArrayLike, Iterable[Stroke], str]], roi: Roi | None = None
    ) -> tuple[ColourPicture, ...]:
        """Return what is kept of pictures and strokes, as `fit_many` takes them.

        Where there are no strokes, the colours of a region of interest alone are counted, if there is one.

        Raises
        ------
        InputError
            As `fit`, and if the region does not lie within a picture.
        """
        kept = []
        for entry in _items("pictures", pictures):
            if not isinstance(entry, (tuple, list)) or len(entry) != 3:
                raise InputError(f"each picture must be a tuple (image, strokes, source), got {shown(entry)}")
            image, given, source = entry
            strokes = _checked_strokes(given)
            array = check_image(image)
            size = int(array.shape[0]), int(array.shape[1])
            sample = ColourSample.of(array, strokes, None if roi is None else Region(roi, size)).to_text()
            cable, ground = (tuple(str(one) for one in strokes if one.cable is kind) for kind in (True, False))
            name = check_text("source", source)
            kept.append(ColourPicture(source=name, size=size, cable=cable, ground=ground, sample=sample))
        return tuple(kept)

    def to_config(self) -> ColourConfig:
        """Return the strokes, where they come from, and the colours that they were drawn on."""
        return self._config


def _checked_strokes(strokes: object) -> tuple[Stroke, ...]:
    given = _items("strokes", strokes)
    if not all(isinstance(stroke, Stroke) for stroke in given):
        raise InputError(f"strokes must be a sequence of Stroke, got {shown(strokes)}")
    return given


def _items(name: str, values: object) -> tuple[Any, ...]:
    if not isinstance(values, Iterable):
        raise InputError(f"{name} must be a sequence, got {shown(values)}")
    return tuple(values)


def _colour_bits(samples: Sequence[ColourSample], *, accept: bool = False) -> npt.NDArray[np.uint8]:
    """Return the bit of every colour, shape (256 red, 256 green, 32 bytes of 8 blues)."""
    cells = log_colours.at_cells(_log_ratio(samples)) > 0.0
    if accept:
        drawn, refused = _mean([sample.cable for sample in samples]), _mean([sample.ground for sample in samples])
        cells |= (drawn > refused)[log_colours.cell_bins()].reshape(cells.shape)
    repeat = LEVELS // log_colours.CELLS
    bits = np.packbits(np.repeat(cells, repeat, axis=2), axis=2, bitorder="little")
    return np.ascontiguousarray(np.repeat(np.repeat(bits, repeat, axis=0), repeat, axis=1))


def _log_ratio(samples: Sequence[ColourSample]) -> FloatArray:
    """Return how much likelier each bin's colour is cable than not, as a logarithm, shape (bins,).

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
