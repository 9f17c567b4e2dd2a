"""Section of the segmentation."""

from __future__ import annotations

from collections.abc import Sequence

import msgspec

from dloftbs.config.colour_words import COLOUR_WORDS, range_of_word, word_meant
from dloftbs.config.local_masks import BackgroundConfig, LocalConfig, keep_file, keep_join
from dloftbs.config.section import Section, keep_integer, keep_number, keep_range, keep_size, require
from dloftbs.config.strokes import ColourConfig
from dloftbs.errors import ConfigError
from dloftbs.support.values import as_float, check_mask_kind, shown

HUE_MAX = 179
"""Largest hue in OpenCV's 8-bit HSV (half degrees)."""
MIN_COLOURED = 40
"""Least saturation and value, of 255, where a range gives none. At both, the channels differ by 6 counts, and a count
of noise turns the hue by 5, a third of a usual range's half: below, hue says little."""

_MAX_INPUT_PX = 10_000  # of a side of a network's input


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
    >>> HsvRange.parse("orange")
    HsvRange(hue=(5, 22))
    >>> str(HsvRange(hue=(100, 130)))
    '100:130,40:255,40:255'
    """

    hue: tuple[int, int]
    saturation: tuple[int, int] = (MIN_COLOURED, 255)
    value: tuple[int, int] = (MIN_COLOURED, 255)

    def __post_init__(self) -> None:
        keep_range(self, "hue", HUE_MAX, wraps=True)
        keep_range(self, "saturation", 255)
        keep_range(self, "value", 255)

    def __str__(self) -> str:
        """Return the notation that `parse` reads."""
        return ",".join(f"{low}:{high}" for low, high in (self.hue, self.saturation, self.value))

    @classmethod
    def parse(cls, text: str) -> HsvRange:
        """Read ``"H0:H1[,S0:S1[,V0:V1]]"`` or a word such as ``"orange"``, as the command line takes them.

        Raises
        ------
        ConfigError
            If the text has another form, a bound is out of range, or the word is unknown.
        """
        notation = range_of_word(text) or text if isinstance(text, str) else ""
        parts = [part.split(":") for part in notation.split(",")]
        try:
            bounds = [(int(low), int(high)) for low, high in parts]
        except ValueError:
            bounds = []
        if not 1 <= len(bounds) <= 3:
            raise ConfigError(
                f"expected an HSV range such as '170:10,80:255,60:255' or a colour ({', '.join(COLOUR_WORDS)}), "
                f"got {shown(text)}{word_meant(text) if isinstance(text, str) else ''}"
            )
        names = ("hue", "saturation", "value")
        return cls(**dict(zip(names, bounds, strict=False)))


class PlaneConfig(Section, frozen=True, kw_only=True):
    """Pixels that stand above the plane on which most of the depth lies, as a table's top.

    Parameters
    ----------
    height_m : float
        Height above the plane from which on a pixel is cable, in metres; usual is somewhat less than half
        of a cable's thickness.
    join : "and" or "or"
        With a colour or a network beside it: whether a pixel must be found by both, or by one of them.
    """

    height_m: float = 0.002
    join: str = "and"

    def __post_init__(self) -> None:
        keep_number(self, "height_m", 1e-5, 100.0)
        keep_join(self)


class NetworkConfig(Section, frozen=True, kw_only=True):
    """A network of the user's own, in an ONNX file, from an image to scores of its pixels.

    Parameters
    ----------
    file : str
        Path of the model.
    size : (int, int) or None
        Rows and columns of the image that the network gets; None: what the model states, or else the image's own.
    multiple : int
        The sides that the network gets are padded to multiples of so many pixels; networks that halve an image four
        times need 16.
    threshold : float
        Score from which on a pixel is cable.
    channel : int or None
        Number of the cable's channel among several of the output; None: a pixel is cable unless channel 0, the
        ground's, has the largest score. With a single channel it counts for nothing.
    order : "rgb" or "bgr"
        Order of the input's channels.
    scale : float
        Factor of the image's counts, before mean and std.
    mean, std : tuple of float
        Subtracted from, and divisor of, each channel, in the order of the channels.
    """

    file: str
    size: tuple[int, int] | None = None
    multiple: int = 1
    threshold: float = 0.5
    channel: int | None = None
    order: str = "rgb"
    scale: float = 1.0 / 255.0
    mean: tuple[float, float, float] = (0.0, 0.0, 0.0)
    std: tuple[float, float, float] = (1.0, 1.0, 1.0)

    def __post_init__(self) -> None:
        keep_file(self, "the path of an ONNX model, in UTF-8")
        if self.size is not None:
            keep_size(self, "size", _MAX_INPUT_PX)
        keep_integer(self, "multiple", 1, 1024)
        keep_number(self, "threshold", -1e6, 1e6)
        if self.channel is not None:
            keep_integer(self, "channel", 0, 10_000)
        require(isinstance(self.order, str) and self.order in ("rgb", "bgr"), "order", "'rgb' or 'bgr'", self.order)
        keep_number(self, "scale", 1e-9, 1e9)
        for name, least in (("mean", -1e6), ("std", 1e-9)):
            given = getattr(self, name)
            numbers = [as_float(number) for number in given] if isinstance(given, (tuple, list)) else []
            valid = len(numbers) == 3 and all(number is not None and least <= number <= 1e6 for number in numbers)
            require(valid, name, f"three numbers in {least:g}..1e+06, one a channel", given)
            msgspec.structs.force_setattr(self, name, tuple(numbers))


class SegmentationConfig(Section, frozen=True, kw_only=True):
    """Image to mask: by colour, the user's network, the surroundings, an empty scene, the depth above a plane.

    A pixel is cable where the ranges, the colour or the network say so. `local`, `background` and `plane` are joined
    with them by their own ``join``: those of ``or`` add to what is cable, and of that each of ``and`` must hold, too.
    Where nothing is given, frames must bring a mask, or the pipeline a segmenter.

    Parameters
    ----------
    hsv : tuple of HsvRange
        Colours of cables, in OpenCV's 8-bit hue (0..179, half degrees), saturation and value (0..255); as text
        ``"170:10,80:255,60:255"``, the first being a hue that wraps around 0, or a word: ``"orange"``. A pixel is cable
        where any of the ranges holds it.
    colour : ColourConfig or None
        Colours learned from strokes on a picture, as `dloftbs colour` prints them.
    plane : PlaneConfig or None
        ``{height_m: 0.002}``: what stands above the dominant plane of the depth by more is cable; joined with the
        others by ``join: and`` or ``or``.
    onnx : NetworkConfig or None
        ``{file: model.onnx}``: a network of your own; further settings are its size, multiple, threshold, channel,
        order, scale, mean and std.
    local : LocalConfig, "darker", "brighter" or None
        ``darker``, or ``{tone: darker, width_px: 12}``: what is darker than its surroundings is cable; further settings
        are its contrast and join.
    background : BackgroundConfig, str or None
        ``empty.png``, or ``{file: empty.png}``: what differs from this picture of the same place without cables is
        cable, for a camera that stands still; further settings are its contrast and join.
    mask_is : "auto", "binary", "probability" or "labels"
        What the values of masks are, where a frame does not say it itself; see `Frame`.
    """

    hsv: tuple[HsvRange, ...] = ()
    colour: ColourConfig | None = None
    plane: PlaneConfig | None = None
    onnx: NetworkConfig | None = None
    local: LocalConfig | str | None = None
    background: BackgroundConfig | str | None = None
    mask_is: str = "auto"

    def __post_init__(self) -> None:
        check_mask_kind(self.mask_is, ConfigError)
        if isinstance(self.local, str):
            msgspec.structs.force_setattr(self, "local", LocalConfig(tone=self.local))
        if isinstance(self.background, str):
            msgspec.structs.force_setattr(self, "background", BackgroundConfig(file=self.background))
        valid = isinstance(self.hsv, tuple) and all(isinstance(box, HsvRange) for box in self.hsv)
        require(valid, "hsv", "a tuple of HsvRange, such as (HsvRange.parse('170:10,80:255'),)", self.hsv)
        for name, kind in _SECTIONS.items():
            given = getattr(self, name)
            require(given is None or isinstance(given, kind), name, f"a {kind.__name__} or None", given)

    @property
    def needs_image(self) -> bool:
        """True if a mask is made of the image."""
        others = (self.colour, self.onnx, self.local, self.background)
        return bool(self.hsv) or any(other is not None for other in others)

    @property
    def is_given(self) -> bool:
        """True if there is any way from a frame to a mask."""
        return self.needs_image or self.plane is not None

    @property
    def files(self) -> tuple[str, ...]:
        """Paths of the files that the section names, on whose contents its masks depend."""
        named = [one for one in (self.background, self.onnx) if one is not None]
        return tuple(one if isinstance(one, str) else one.file for one in named)

    def with_hsv(self, colour: Colour) -> SegmentationConfig:
        """Return the section with other ranges of hue, in the place of its colour from strokes, too.

        Raises
        ------
        ConfigError
            As `read_colour`.
        """
        return msgspec.structs.replace(self, hsv=read_colour(colour), colour=None)


_SECTIONS: dict[str, type[Section]] = {
    "colour": ColourConfig,
    "plane": PlaneConfig,
    "onnx": NetworkConfig,
    "local": LocalConfig,
    "background": BackgroundConfig,
}

Colour = str | HsvRange | Sequence[str | HsvRange]
"""A colour as people write it: a range or several, each an `HsvRange`, its notation or a word."""


def read_colour(colour: Colour) -> tuple[HsvRange, ...]:
    """Return the ranges of a colour.

    Raises
    ------
    ConfigError
        If it is of another type, or a range cannot be read.
    """
    given = (colour,) if isinstance(colour, (str, HsvRange)) else colour
    valid = isinstance(given, Sequence) and all(isinstance(part, (str, HsvRange)) for part in given)
    require(valid, "hsv", "a range such as '170:10,80:255,60:255', a colour such as 'red', or several", colour)
    return tuple(part if isinstance(part, HsvRange) else HsvRange.parse(part) for part in given)
