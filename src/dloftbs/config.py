"""The configuration: one frozen, validated section per stage; every default of the package stands here, once.

Lengths in pixels end in ``_px``; the letters of the paper (Kicki, Szymko, Walas, ICRA 2023) stand in the docstrings.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any, Literal

import msgspec

from dloftbs._documents import parse_yaml, read_text
from dloftbs._values import as_integer, check_integer, check_number, shown
from dloftbs.errors import ConfigError, InputError

HUE_MAX = 179
"""Largest hue in OpenCV's 8-bit HSV (half degrees)."""
NEAREST_M, FARTHEST_M = 1e-30, 1e30
"""Depth that is read at all, metres: it, its reciprocal and the squares and cubes of both are numbers and not 0, the
former two in float32 as well. Far beyond any sensor; a greater stored value is no depth."""

_LEAST, _MOST = 1e-9, 1_000_000_000  # of any number here: far from what is of use, and what is computed of it is finite
_SHORTEST_S = 1e-6  # from frame to frame


class Section(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Base of the sections: immutable, compared by value, unknown keys refused."""


def _require(condition: bool, name: str, expected: str, value: object) -> None:
    if not condition:
        raise ConfigError(f"{name} must be {expected}, got {shown(value)}")


def _check_integer(section: Section, name: str, low: int, high: int) -> None:
    """Check an integer, and keep it as an int."""
    number = check_integer(name, getattr(section, name), low, high, ConfigError)
    msgspec.structs.force_setattr(section, name, number)


def _check_number(section: Section, name: str, low: float, high: float) -> None:
    """Check a number, and keep it as a float."""
    number = check_number(name, getattr(section, name), low, high, ConfigError)
    msgspec.structs.force_setattr(section, name, number)


def _check_range(section: Section, name: str, top: int, *, wraps: bool = False) -> None:
    """Check a range of integers, and keep it as a tuple of int."""
    given = getattr(section, name)
    bounds = tuple(as_integer(bound) for bound in given) if isinstance(given, tuple) else ()
    valid = len(bounds) == 2 and all(bound is not None and 0 <= bound <= top for bound in bounds)
    expected = f"a tuple of two integers in 0..{top}" + ("" if wraps else ", low before high")
    _require(valid and (wraps or given[0] <= given[1]), name, expected, given)
    msgspec.structs.force_setattr(section, name, bounds)


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
        _check_range(self, "hue", HUE_MAX, wraps=True)
        _check_range(self, "saturation", 255)
        _check_range(self, "value", 255)

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
        _require(valid, "hsv", "a tuple of HsvRange", self.hsv)


class CleaningConfig(Section, frozen=True, kw_only=True):
    """Morphology on the mask.

    Parameters
    ----------
    open_px : int
        Side of the square of the morphological opening; the paper's is 3, and 1 is none (for the thinnest cables).
    close_px : int
        Side of the square of a closing before it. Added pixels stay only where they fill a pin-hole wholly, or a
        notch of some pixels: slits between cables stay open. 1, the paper's, is none.
    thin_px : int
        Least number of connected pixels that come back after the opening took them: a cable of one or two pixels, and
        no salt. 0, the paper's, brings nothing back.
    fill_holes : bool
        Whether holes that are narrower than the cables and lie within one of them are filled, such as the highlight on
        a glossy cable in a large picture. False is the paper's.
    """

    open_px: int = 3
    close_px: int = 3
    thin_px: int = 20
    fill_holes: bool = True

    def __post_init__(self) -> None:
        for name in ("open_px", "close_px"):
            side = as_integer(getattr(self, name))
            valid = side is not None and 1 <= side <= 99 and side % 2 == 1
            _require(valid, name, "an odd integer in 1..99", getattr(self, name))
            msgspec.structs.force_setattr(self, name, side)
        _check_integer(self, "thin_px", 0, _MOST)
        _require(isinstance(self.fill_holes, bool), "fill_holes", "true or false", self.fill_holes)


class SegmentsConfig(Section, frozen=True, kw_only=True):
    """Skeleton to segments.

    Parameters
    ----------
    max_segments : int
        More than this many segments is no cable but noise: the frame is refused with a reason, which bounds its cost.
    """

    max_segments: int = 1000

    def __post_init__(self) -> None:
        _check_integer(self, "max_segments", 1, _MOST)


class ObjectsConfig(Section, frozen=True, kw_only=True):
    """Selection of the centre lines that are objects: the base of all linking sections.

    Parameters
    ----------
    objects : int or None
        Number of objects, where it is known: only the longest ones are kept, and the rest is reported in
        `FrameResult.dropped`. The default method also bridges gaps that it is in doubt about where these become longer
        by it; nothing else is joined. Where fewer were found, they stay. None: as many as there seem to be.
    min_length_px : int
        Shorter objects are none. With the published method its ``p``: segments of fewer pixels are dropped.
    min_length_widths : float
        Objects that are shorter, in widths of their own, are none.
    """

    objects: int | None = None
    min_length_px: int = 10
    min_length_widths: float = 1.5

    def __post_init__(self) -> None:
        if self.objects is not None:
            _check_integer(self, "objects", 1, _MOST)
        _check_integer(self, "min_length_px", 0, _MOST)
        _check_number(self, "min_length_widths", 0.0, _MOST)


class LinkingConfig(ObjectsConfig, frozen=True, kw_only=True, tag_field="method", tag="bending"):
    """Segments to centre lines, by what bends least; lengths are in widths of the cable.

    Parameters
    ----------
    objects, min_length_px, min_length_widths
        As for `ObjectsConfig`.
    max_gap_widths : float
        Longest gap that is bridged.
    """

    max_gap_widths: float = 25.0

    def __post_init__(self) -> None:
        super().__post_init__()
        _check_number(self, "max_gap_widths", 0.0, _MOST)


class GreedyLinkingConfig(ObjectsConfig, frozen=True, kw_only=True, tag_field="method", tag="greedy"):
    """Segments to centre lines, as published.

    Parameters
    ----------
    objects, min_length_widths
        As for `ObjectsConfig`.
    min_length_px : int
        The paper's ``p``: segments of fewer pixels are dropped. At least 2, since one pixel has no direction.
    distance_weight : float
        The paper's ``m`` in ``J = m J_d + (1 - m) J_o``, in 0..1.
    max_cost : float or None
        The paper's ``J_th``: two ends are joined only while ``J < max_cost``. It gives no value; the authors' code has
        2 for several cables, and none for one: None joins all segments.
    direction_px : int
        Number of pixels over which the direction of a segment's end is taken; the paper gives none.
    """

    distance_weight: float = 0.05
    max_cost: float | None = 2.0
    direction_px: int = 10

    def __post_init__(self) -> None:
        super().__post_init__()
        _check_integer(self, "min_length_px", 2, _MOST)
        _check_number(self, "distance_weight", 0.0, 1.0)
        if self.max_cost is not None:
            _check_number(self, "max_cost", 0.0, _MOST)
        _check_integer(self, "direction_px", 2, _MOST)


class FittingConfig(Section, frozen=True, kw_only=True):
    """Centre line to B-spline.

    Parameters
    ----------
    knots : int or None
        The paper's ``k``: distinct knots, both ends included, equidistant in element number. A centre line with too few
        points for them gets fewer. None: as many as the curve needs.
    tolerance_px : float
        Largest distance of the points from the curve over a stretch one and a half times as long as the object is wide;
        knots are added until it is met. Only without a given number of knots.
    """

    knots: int | None = None
    tolerance_px: float = 0.2

    def __post_init__(self) -> None:
        if self.knots is not None:
            _check_integer(self, "knots", 2, 1000)
        _check_number(self, "tolerance_px", _LEAST, _MOST)


class DepthConfig(Section, frozen=True, kw_only=True):
    """Meaning of the values of depth images: the base of all lifting sections.

    Parameters
    ----------
    integer_unit_m : float
        Metres per count of an integer depth image (0.001: millimetres), within `NEAREST_M` and `FARTHEST_M`.
        Floating-point depth is in metres.
    min_depth_m, max_depth_m : float
        Depth outside of this range, 0, NaN and infinity count as missing; so does depth nearer than `NEAREST_M` or
        farther than `FARTHEST_M`.
    """

    integer_unit_m: float = 0.001
    min_depth_m: float = 0.0
    max_depth_m: float = 20.0

    def __post_init__(self) -> None:
        _check_number(self, "integer_unit_m", _LEAST, _MOST)
        _check_number(self, "min_depth_m", 0.0, _MOST)
        _check_number(self, "max_depth_m", _LEAST, _MOST)
        limits = (self.min_depth_m, self.max_depth_m)
        _require(limits[0] < limits[1], "min_depth_m, max_depth_m", "numbers with min < max", limits)

    @property
    def range_m(self) -> tuple[float, float]:
        """The nearest and the farthest depth that is read; whatever reads depth takes its range from here."""
        return max(self.min_depth_m, NEAREST_M), min(self.max_depth_m, FARTHEST_M)


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
    override_frames : int
        Number of frames after which contradicted evidence is dropped: a stretch that is missing at the same place of an
        object in all of them is no part of it. A stretch that was seen in as many is known well enough to read frames
        by it.
    smoothing_s : float
        Lag of the published curves, which makes them smoother; 0: neither.
    frame_s : float
        Seconds from frame to frame where frames have no stamps.
    on_new_size, on_old_stamp : str
        Reaction to a frame of another size, or of a stamp before the last one: ``"reset"`` forgets the tracks,
        ``"error"`` raises an `InputError`.
    """

    gate: float = 0.1
    min_hits: int = 2
    keep_lost_s: float = 2.0
    override_frames: int = 8
    smoothing_s: float = 0.0
    frame_s: float = 1.0 / 30.0
    on_new_size: Literal["reset", "error"] = "reset"
    on_old_stamp: Literal["reset", "error"] = "reset"

    def __post_init__(self) -> None:
        _check_number(self, "gate", _LEAST, _MOST)
        _check_integer(self, "min_hits", 1, _MOST)
        _check_integer(self, "override_frames", 1, _MOST)
        _check_number(self, "keep_lost_s", 0.0, _MOST)
        _check_number(self, "smoothing_s", 0.0, _MOST)
        _check_number(self, "frame_s", _SHORTEST_S, _MOST)
        for name in ("on_new_size", "on_old_stamp"):
            way = getattr(self, name)
            _require(isinstance(way, str) and way in ("reset", "error"), name, "'reset' or 'error'", way)


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
    def paper(cls, *, objects: int | None = None) -> Config:
        """Return the published method with its parameters (``m = 0.05``, ``p = 10``, ``k = 25``).

        Parameters
        ----------
        objects : int, optional
            Number of cables. With 1 it is the authors' form for one cable, which joins all segments; otherwise
            the one for several, with ``J_th = 2``.

        Raises
        ------
        ConfigError
            If `objects` is no integer of at least 1.
        """
        return cls(
            cleaning=CleaningConfig(open_px=3, close_px=1, thin_px=0, fill_holes=False),
            linking=GreedyLinkingConfig(
                objects=objects,
                min_length_px=10,
                min_length_widths=0.0,
                distance_weight=0.05,
                max_cost=None if objects == 1 else 2.0,
                direction_px=10,
            ),
            fitting=FittingConfig(knots=25),
            lifting=PixelLiftingConfig(),
            tracking=NearestTrackingConfig(),
        )

    @classmethod
    def from_dict(cls, data: dict[str, Any]) -> Config:
        """Build a configuration from nested dictionaries; omitted values keep their defaults.

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
            documents = parse_yaml(read_text(Path(path)))
        except InputError as error:
            raise ConfigError(f"cannot read the configuration {str(path)!r}: {error}") from error
        if len(documents) > 1:
            raise ConfigError(f"{path}: must hold one configuration, found {len(documents)} documents")
        try:
            return cls.from_dict(documents[0] if documents else {})
        except ConfigError as error:
            raise ConfigError(f"{path}: {error}") from error

    def to_dict(self) -> dict[str, Any]:
        """Return nested dictionaries of plain values, ready for JSON, as `from_dict` takes them."""
        # By way of JSON, which turns tuples into lists.
        result: dict[str, Any] = msgspec.json.decode(msgspec.json.encode(self))
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
        valid = isinstance(changes, dict) and all(isinstance(path, str) for path in changes)
        _require(valid, "changes", "a dictionary of values by dotted paths", changes)
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
                raise ConfigError(f"unknown configuration key {shown(path)}")
            section[key] = value
        return type(self).from_dict(data)
