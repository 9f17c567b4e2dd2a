"""Section of the segmentation."""

from __future__ import annotations

from dloftbs._values import shown
from dloftbs.config.section import Section, keep_range, require
from dloftbs.errors import ConfigError

HUE_MAX = 179
"""Largest hue in OpenCV's 8-bit HSV (half degrees)."""


class HsvRange(Section, frozen=True, kw_only=True):
    """A box in OpenCV's 8-bit HSV space, bounds included.

    Parameters
    ----------
    hue : (int, int)
        Low and high hue in 0..179 (half degrees). Where low exceeds high it wraps around 0: red is ``(170, 10)``.
    saturation, value : (int, int)
        Low and high in 0..255.
    """

    hue: tuple[int, int]
    saturation: tuple[int, int] = (0, 255)
    value: tuple[int, int] = (0, 255)

    def __post_init__(self) -> None:
        keep_range(self, "hue", HUE_MAX, wraps=True)
        keep_range(self, "saturation", 255)
        keep_range(self, "value", 255)

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
        A pixel is cable where any of the ranges holds it. Empty: frames must bring a mask, or the pipeline a segmenter.
    """

    hsv: tuple[HsvRange, ...] = ()

    def __post_init__(self) -> None:
        valid = isinstance(self.hsv, tuple) and all(isinstance(box, HsvRange) for box in self.hsv)
        require(valid, "hsv", "a tuple of HsvRange", self.hsv)
