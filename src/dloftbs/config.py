"""The configuration: one frozen, validated section per stage; every default of the package stands here, once.

Lengths in pixels end in ``_px``; the letters of the paper (Kicki, Szymko, Walas, ICRA 2023) stand in the docstrings.
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any, Literal, TypeGuard

import msgspec

from dloftbs.errors import ConfigError

HUE_MAX = 179
"""Largest hue in OpenCV's 8-bit HSV (half degrees)."""


class Section(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Base of the sections: immutable, compared by value, unknown keys refused."""


def _require(condition: bool, name: str, expected: str, value: object) -> None:
    if not condition:
        raise ConfigError(f"{name} must be {expected}, got {value!r}")


def _is_int(value: object) -> TypeGuard[int]:
    return isinstance(value, int) and not isinstance(value, bool)


def _is_number(value: object) -> bool:
    return isinstance(value, (int, float)) and not isinstance(value, bool) and not math.isnan(value)


def _check_int(name: str, value: object, low: int) -> None:
    _require(_is_int(value) and value >= low, name, f"an integer of at least {low}", value)


def _check_range(name: str, bounds: tuple[int, int], top: int, *, wraps: bool = False) -> None:
    expected = f"a tuple of two integers in 0..{top}" + ("" if wraps else ", low before high")
    valid = isinstance(bounds, tuple) and len(bounds) == 2 and all(_is_int(b) and 0 <= b <= top for b in bounds)
    _require(valid and (wraps or bounds[0] <= bounds[1]), name, expected, bounds)


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
        _check_range("hue", self.hue, HUE_MAX, wraps=True)
        _check_range("saturation", self.saturation, 255)
        _check_range("value", self.value, 255)

    @classmethod
    def parse(cls, text: str) -> HsvRange:
        """Read ``"H0:H1[,S0:S1[,V0:V1]]"``, as the command line takes it.

        Raises
        ------
        ConfigError
            If the text has another form, or a bound is out of range.
        """
        parts = [part.split(":") for part in text.split(",")]
        try:
            bounds = [(int(low), int(high)) for low, high in parts]
        except ValueError:
            bounds = []
        if not 1 <= len(bounds) <= 3:
            raise ConfigError(f"expected an HSV range such as '170:10,80:255,60:255', got {text!r}")
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
        _require(valid, "hsv", "a tuple of HsvRange", self.hsv)


class CleaningConfig(Section, frozen=True, kw_only=True):
    """Morphology on the mask.

    Parameters
    ----------
    open_px : int
        Side of the square of the morphological opening; the paper's is 3, and 1 is none (for the thinnest cables).
    close_px : int
        Side of the square of a closing before it. What that adds stays only where it fills a pin-hole wholly, or a
        notch of some pixels: slits between cables stay open. 1, the paper's, is none.
    thin_px : int
        What the opening takes comes back where it hangs together over this many pixels or more: a cable of one or two
        pixels, and no salt. 0, the paper's, brings nothing back.
    """

    open_px: int = 3
    close_px: int = 3
    thin_px: int = 20

    def __post_init__(self) -> None:
        for name in ("open_px", "close_px"):
            side = getattr(self, name)
            _require(_is_int(side) and 1 <= side <= 99 and side % 2 == 1, name, "an odd integer in 1..99", side)
        _check_int("thin_px", self.thin_px, 0)


class SegmentsConfig(Section, frozen=True, kw_only=True):
    """Skeleton to segments.

    Parameters
    ----------
    max_segments : int
        More than this many segments is no cable but noise: the frame is refused with a reason, which bounds its cost.
    """

    max_segments: int = 1000

    def __post_init__(self) -> None:
        _check_int("max_segments", self.max_segments, 1)


class LinkingConfig(Section, frozen=True, kw_only=True, tag_field="method", tag="bending"):
    """Segments to centre lines, by what bends least; lengths are in widths of the cable.

    Parameters
    ----------
    objects : int or None
        How many cables there are, where that is known: what is found is joined until there are no more. None: as many
        as there seem to be.
    max_gap_widths : float
        Longest gap that is bridged.
    """

    objects: int | None = None
    max_gap_widths: float = 25.0

    def __post_init__(self) -> None:
        valid = self.objects is None or (_is_int(self.objects) and self.objects >= 1)
        _require(valid, "objects", "None or an integer of at least 1", self.objects)
        longest = self.max_gap_widths
        _require(_is_number(longest) and longest >= 0.0, "max_gap_widths", "a number of at least 0", longest)


class GreedyLinkingConfig(Section, frozen=True, kw_only=True, tag_field="method", tag="greedy"):
    """Segments to centre lines, as published.

    Parameters
    ----------
    min_length_px : int
        The paper's ``p``: segments of fewer pixels are dropped. At least 2, since one pixel has no direction.
    distance_weight : float
        The paper's ``m`` in ``J = m J_d + (1 - m) J_o``, in 0..1.
    max_cost : float
        The paper's ``J_th``, for which it gives no value: two ends are joined only while ``J < max_cost``.
    direction_px : int
        Number of pixels over which the direction of a segment's end is taken; the paper gives none.
    """

    min_length_px: int = 10
    distance_weight: float = 0.05
    max_cost: float = 8.0
    direction_px: int = 10

    def __post_init__(self) -> None:
        _check_int("min_length_px", self.min_length_px, 2)
        m = self.distance_weight
        _require(_is_number(m) and 0.0 <= m <= 1.0, "distance_weight", "a number in 0..1", m)
        _require(
            _is_number(self.max_cost) and self.max_cost >= 0.0, "max_cost", "a number of at least 0", self.max_cost
        )
        _check_int("direction_px", self.direction_px, 2)


class FittingConfig(Section, frozen=True, kw_only=True):
    """Centre line to B-spline.

    Parameters
    ----------
    knots : int or None
        The paper's ``k``: distinct knots, both ends included, equidistant in element number. A centre line with too few
        points for them gets fewer. None: as many as the curve needs.
    tolerance_px : float
        Where the need decides: knots are added while the points lie farther than this beside the curve over a stretch
        one and a half times as long as the object is wide.
    """

    knots: int | None = None
    tolerance_px: float = 0.2

    def __post_init__(self) -> None:
        valid = self.knots is None or (_is_int(self.knots) and 2 <= self.knots <= 1000)
        _require(valid, "knots", "None or an integer in 2..1000", self.knots)
        tolerance = self.tolerance_px
        valid = _is_number(tolerance) and 0.0 < tolerance < math.inf
        _require(valid, "tolerance_px", "a positive number", tolerance)


class DepthConfig(Section, frozen=True, kw_only=True):
    """What depth images hold: the base of the ways to lift.

    Parameters
    ----------
    integer_unit_m : float
        Metres per count of an integer depth image (0.001: millimetres). Floating-point depth is in metres.
    min_depth_m, max_depth_m : float
        Depth outside of this range, 0, NaN and infinity count as missing.
    """

    integer_unit_m: float = 0.001
    min_depth_m: float = 0.0
    max_depth_m: float = 20.0

    def __post_init__(self) -> None:
        unit = self.integer_unit_m
        _require(_is_number(unit) and 0.0 < unit < math.inf, "integer_unit_m", "a positive number", unit)
        low, high = self.min_depth_m, self.max_depth_m
        valid = _is_number(low) and _is_number(high) and 0.0 <= low < high
        _require(valid, "min_depth_m, max_depth_m", "numbers with 0 <= min < max", (low, high))


class LiftingConfig(DepthConfig, frozen=True, kw_only=True, tag_field="method", tag="axis"):
    """Depth image to metres: the axis of each object, from a robust smooth line along its surface.

    Parameters
    ----------
    integer_unit_m, min_depth_m, max_depth_m
        As for `DepthConfig`.
    """


class PixelLiftingConfig(DepthConfig, frozen=True, kw_only=True, tag_field="method", tag="pixels"):
    """Depth image to metres, as published: each pixel of a centre line by itself, on the surface.

    Parameters
    ----------
    integer_unit_m, min_depth_m, max_depth_m
        As for `DepthConfig`.
    """


class TrackingConfig(Section, frozen=True, kw_only=True, tag_field="method", tag="motion"):
    """Detections to tracks, by where they are expected.

    Parameters
    ----------
    gate : float
        A detection is the same object as a track only while their mean distance is below this share of the length, the
        geometric mean of both lengths being meant. It widens while the track is not seen.
    min_hits : int
        Frames in a row in which an object must be seen before its track is confirmed.
    keep_lost_s : float
        Seconds for which a confirmed track of which nothing is seen can be found again under its id.
    settle_frames : int
        What a frame contradicts is believed for no longer than so many frames: a stretch that is missing at the same
        place of an object for so long is no part of it. And what was seen in so many is known well enough that frames
        are read by it.
    smoothing_s : float
        By how much the published curves lag behind, for being smoother; 0: neither.
    frame_s : float
        Seconds from frame to frame where frames have no stamps.
    on_new_size, on_old_stamp : str
        What happens at a frame of another size, or of a stamp before the last one: ``"reset"`` forgets the tracks,
        ``"error"`` raises an `InputError`.
    """

    gate: float = 0.1
    min_hits: int = 2
    keep_lost_s: float = 2.0
    settle_frames: int = 8
    smoothing_s: float = 0.0
    frame_s: float = 1.0 / 30.0
    on_new_size: Literal["reset", "error"] = "reset"
    on_old_stamp: Literal["reset", "error"] = "reset"

    def __post_init__(self) -> None:
        _require(_is_number(self.gate) and self.gate > 0.0, "gate", "a positive number", self.gate)
        _check_int("min_hits", self.min_hits, 1)
        _check_int("settle_frames", self.settle_frames, 1)
        for name in ("keep_lost_s", "smoothing_s"):
            seconds = getattr(self, name)
            valid = _is_number(seconds) and 0.0 <= seconds < math.inf
            _require(valid, name, "a number of at least 0", seconds)
        valid = _is_number(self.frame_s) and 0.0 < self.frame_s < math.inf
        _require(valid, "frame_s", "a positive number", self.frame_s)
        for name in ("on_new_size", "on_old_stamp"):
            way = getattr(self, name)
            _require(way in ("reset", "error"), name, "'reset' or 'error'", way)


class NearestTrackingConfig(Section, frozen=True, kw_only=True, tag_field="method", tag="nearest"):
    """Detections to tracks, as published: by the nearest curve of the frame before, and nothing else."""


_METHODS: dict[str, tuple[type[Section], ...]] = {
    "linking": (LinkingConfig, GreedyLinkingConfig),
    "lifting": (LiftingConfig, PixelLiftingConfig),
    "tracking": (TrackingConfig, NearestTrackingConfig),
}
"""Sections with several methods, the default one first."""


class Config(Section, frozen=True, kw_only=True):
    """The whole configuration, a section per stage.

    Examples
    --------
    >>> Config().replace({"fitting.knots": 40}).fitting.knots
    40
    """

    segmentation: SegmentationConfig = SegmentationConfig()
    cleaning: CleaningConfig = CleaningConfig()
    segments: SegmentsConfig = SegmentsConfig()
    linking: LinkingConfig | GreedyLinkingConfig = LinkingConfig()
    fitting: FittingConfig = FittingConfig()
    lifting: LiftingConfig | PixelLiftingConfig = LiftingConfig()
    tracking: TrackingConfig | NearestTrackingConfig = TrackingConfig()

    def __post_init__(self) -> None:
        for name, default in zip(self.__struct_fields__, self.__struct_defaults__, strict=True):
            kinds = _METHODS.get(name, (type(default),))
            expected = " or ".join(f"a {kind.__name__}" for kind in kinds)
            _require(isinstance(getattr(self, name), kinds), name, expected, getattr(self, name))

    @classmethod
    def paper(cls) -> Config:
        """Return the published method with its parameters (``m = 0.05``, ``p = 10``, ``k = 25``)."""
        return cls(
            cleaning=CleaningConfig(open_px=3, close_px=1, thin_px=0),
            linking=GreedyLinkingConfig(min_length_px=10, distance_weight=0.05, max_cost=8.0, direction_px=10),
            fitting=FittingConfig(knots=25),
            lifting=PixelLiftingConfig(),
            tracking=NearestTrackingConfig(),
        )

    @classmethod
    def from_dict(cls, data: dict[str, Any]) -> Config:
        """Build a configuration from nested dictionaries; what is left out keeps its default.

        The sections `linking`, `lifting` and `tracking` may name their ``method``: ``"bending"`` or ``"greedy"``,
        ``"axis"`` or ``"pixels"``, ``"motion"`` or ``"nearest"``; it is the first one, where they do not.

        Raises
        ------
        ConfigError
            On an unknown key, a wrong type or a value out of range, with the path of the culprit.
        """
        for name, (default, *_) in _METHODS.items():
            section = data.get(name) if isinstance(data, dict) else None
            if isinstance(section, dict) and "method" not in section:
                data = {**data, name: {"method": default.__struct_config__.tag, **section}}
        try:
            return msgspec.convert(data, cls)
        except msgspec.ValidationError as error:
            raise ConfigError(str(error)) from error

    @classmethod
    def from_yaml(cls, path: str | Path) -> Config:
        """Read a YAML file.

        Raises
        ------
        ConfigError
            If the file cannot be read, is no YAML, or says what `from_dict` refuses.
        """
        try:
            data = msgspec.yaml.decode(Path(path).read_bytes())
        except (OSError, msgspec.DecodeError) as error:
            raise ConfigError(f"cannot read the configuration {str(path)!r}: {error}") from error
        try:
            return cls.from_dict({} if data is None else data)
        except ConfigError as error:
            raise ConfigError(f"{path}: {error}") from error

    def to_dict(self) -> dict[str, Any]:
        """Return nested dictionaries of plain Python values, as `from_dict` takes them."""
        result: dict[str, Any] = msgspec.to_builtins(self)
        return result

    def to_yaml(self) -> str:
        """Return the configuration as YAML text, every value stated."""
        return msgspec.yaml.encode(self).decode()

    def replace(self, changes: dict[str, Any]) -> Config:
        """Return a copy with the values at dotted paths replaced, checked as a whole.

        Parameters
        ----------
        changes : dict of str to value
            For example ``{"linking.objects": 2}``.

        Raises
        ------
        ConfigError
            As `from_dict`.
        """
        data = self.to_dict()
        for name in _METHODS:
            method = changes.get(f"{name}.method")
            if method not in (None, data[name]["method"]):  # another method has other settings
                data = type(self).from_dict({**data, name: {"method": method}}).to_dict()
        for path, value in changes.items():
            *parents, key = path.split(".")
            section: Any = data
            for parent in parents:
                section = section.get(parent) if isinstance(section, dict) else None
            if not isinstance(section, dict) or key not in section:
                raise ConfigError(f"unknown configuration key {path!r}")
            section[key] = value
        return type(self).from_dict(data)
