"""Section of the segmentation."""

from __future__ import annotations

from collections.abc import Sequence

from dloftbs._values import shown
from dloftbs.config.section import Section, keep_range, require
from dloftbs.errors import ConfigError

HUE_MAX = 179
"""Largest hue in OpenCV's 8-bit HSV (half degrees)."""
LEAST_COLOURED = 40
"""Least saturation and value, of 255, where a range gives none. At both, the channels differ by 6 counts, and a count
of noise turns the hue by 5, a third of a usual range's half: below, hue says little."""


class HsvRange(Section, frozen=True, kw_only=True):
    """A box in OpenCV's 8-bit HSV space, bounds included.

    Parameters
    ----------
    hue : (int, int)
        Low and high hue in 0..179 (half degrees). Where low exceeds high it wraps around 0: red is ``(170, 10)``.
    saturation, value : (int, int)
        Low and high in 0..255. By default from 40: what is nearly grey or black has a hue by chance.

    Examples
    --------
    >>> HsvRange.parse("170:10,80:255")
    HsvRange(hue=(170, 10), saturation=(80, 255))
    >>> str(HsvRange(hue=(100, 130)))
    '100:130,40:255,40:255'
    """

    hue: tuple[int, int]
    saturation: tuple[int, int] = (LEAST_COLOURED, 255)
    value: tuple[int, int] = (LEAST_COLOURED, 255)

    def __post_init__(self) -> None:
        keep_range(self, "hue", HUE_MAX, wraps=True)
        keep_range(self, "saturation", 255)
        keep_range(self, "value", 255)

    def __str__(self) -> str:
        """Return the notation that `parse` reads."""
        return ",".join(f"{low}:{high}" for low, high in (self.hue, self.saturation, self.value))

    @classmethod
    def parse(cls, text: str) -> HsvRange:
        """Read ``"H0:H1[,S0:S1[,V0:V1]]"``, as the command line takes it.

        Raises
        ------
        ConfigError
            If the text has another form, or a bound is out of range.
        """
        parts = [part.split(":") for part in text.split(",")] if isinstance(text, str) else []
        try:
            bounds = [(int(low), int(high)) for low, high in parts]
        except ValueError:
            bounds = []
        if not 1 <= len(bounds) <= 3:
            raise ConfigError(f"expected an HSV range such as '170:10,80:255,60:255', got {shown(text)}")
        names = ("hue", "saturation", "value")
        return cls(**dict(zip(names, bounds, strict=False)))


class SegmentationConfig(Section, frozen=True, kw_only=True):
    """Colour image to mask.

    Parameters
    ----------
    hsv : tuple of HsvRange
        Colours of cables, in OpenCV's 8-bit hue (0..179, half degrees), saturation and value (0..255); as text
        ``"170:10,80:255,60:255"``, the first being a hue that wraps around 0. A pixel is cable where any of the ranges
        holds it. Empty: frames must bring a mask, or the pipeline a segmenter.
    """

    hsv: tuple[HsvRange, ...] = ()

    def __post_init__(self) -> None:
        valid = isinstance(self.hsv, tuple) and all(isinstance(box, HsvRange) for box in self.hsv)
        require(valid, "hsv", "a tuple of HsvRange, such as (HsvRange.parse('170:10,80:255'),)", self.hsv)


Colour = str | HsvRange | Sequence[str | HsvRange]
"""A colour as people write it: a range or several, each an `HsvRange` or its notation."""


def read_colour(colour: Colour) -> tuple[HsvRange, ...]:
    """Return the ranges of a colour.

    Raises
    ------
    ConfigError
        If it is of another type, or a range cannot be read.
    """
    given = (colour,) if isinstance(colour, (str, HsvRange)) else colour
    valid = isinstance(given, Sequence) and all(isinstance(part, (str, HsvRange)) for part in given)
    require(valid, "hsv", "a range such as '170:10,80:255,60:255', or several", colour)
    return tuple(part if isinstance(part, HsvRange) else HsvRange.parse(part) for part in given)
