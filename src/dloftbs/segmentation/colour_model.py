"""Stage 1: colour image to mask, by colours learned from strokes that somebody drew."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from dloftbs._arrays import FloatArray, check_image
from dloftbs._values import check_text, check_type, shown
from dloftbs.config import ColourConfig, ColourPicture, Stroke
from dloftbs.errors import InputError
from dloftbs.segmentation import log_colours
from dloftbs.segmentation.colour_samples import ColourSample
from dloftbs.segmentation.colour_table import LEVELS, ColourTable

_SCALES = ((0.6, 0.20, 0.10), (0.3, 0.50, 0.20), (0.1, 1.00, 0.40))
_OUTLIERS = 0.3
_ROUNDS = 4
_PRIOR = 0.05
_NOT_SHARE = 0.3


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
        super().__init__(_colour_bits([ColourSample.from_text(picture.sample) for picture in config.pictures]))

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
        kept = []
        for entry in _items("pictures", pictures):
            if not isinstance(entry, (tuple, list)) or len(entry) != 3:
                raise InputError(f"each picture must be a tuple (image, strokes, source), got {shown(entry)}")
            image, given, source = entry
            strokes = _checked_strokes(given)
            array = check_image(image)
            sample = ColourSample.of(array, strokes).to_text()
            cable, ground = (tuple(str(one) for one in strokes if one.cable is kind) for kind in (True, False))
            size = int(array.shape[0]), int(array.shape[1])
            name = check_text("source", source)
            kept.append(ColourPicture(source=name, size=size, cable=cable, ground=ground, sample=sample))
        return cls(ColourConfig(pictures=tuple(kept)))

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


def _colour_bits(samples: Sequence[ColourSample]) -> npt.NDArray[np.uint8]:
    """Return the bit of every colour, shape (256 red, 256 green, 32 bytes of 8 blues)."""
    cells = log_colours.at_cells(_log_ratio(samples)) > 0.0
    repeat = LEVELS // log_colours.CELLS
    bits = np.packbits(np.repeat(cells, repeat, axis=2), axis=2, bitorder="little")
    return np.ascontiguousarray(np.repeat(np.repeat(bits, repeat, axis=0), repeat, axis=1))


def _log_ratio(samples: Sequence[ColourSample]) -> FloatArray:
    """Return how much likelier each bin's colour is cable than not, as a logarithm, shape (bins,)."""
    drawn = _mean([sample.cable for sample in samples])
    other = _mean([sample.ground for sample in samples])
    rest = _mean([sample.rest for sample in samples])
    cable, ground = _smooth(drawn), _smooth(rest)
    for _ in range(_ROUNDS):
        kept = cable / (cable + _OUTLIERS / (1.0 - _OUTLIERS) * ground)
        cable = _smooth(drawn * kept)
        found = _PRIOR * cable / (_PRIOR * cable + (1.0 - _PRIOR) * ground)
        ground = _smooth(rest * (1.0 - found))
        if other.any():
            ground = (1.0 - _NOT_SHARE) * ground + _NOT_SHARE * _smooth(other)
    return np.asarray(np.log(_PRIOR * cable) - np.log((1.0 - _PRIOR) * ground))


def _smooth(histogram: FloatArray) -> FloatArray:
    return log_colours.smooth(histogram, _SCALES) + 1e-12


def _mean(histograms: Sequence[FloatArray]) -> FloatArray:
    """Return the mean of the histograms that count anything, each as shares."""
    shares = [counts / counts.sum() for counts in histograms if counts.any()]
    return np.mean(shares, axis=0) if shares else np.zeros_like(histograms[0])
