"""Strokes on pictures that say what is cable, and the sections that keep them."""

from __future__ import annotations

import msgspec

from dloftbs.config.section import Section, keep_number, keep_size, require
from dloftbs.errors import ConfigError
from dloftbs.support.values import MAX_PX, as_float, shown

_MAX_POINTS = 10_000  # of a stroke: an hour of a mouse's reports is none
_MAX_PICTURES = 1000
_FORM = "X,Y[:X,Y...][/RADIUS], such as 330,220:360,240"


class Stroke(Section, frozen=True, kw_only=True):
    """A line that somebody drew on a picture to say that what lies beneath it is cable, or is not.

    Parameters
    ----------
    points : sequence of (float, float)
        Pixels x, y of the picture, in the order of drawing; a single one is a click. Kept as tuples.
    cable : bool
        Whether the colours beneath are the cable's; otherwise they are of what is not cable.
    radius_px : float
        Half the width of the line. It may reach over the cable's border: colours that the rest of the picture is made
        of are left out.

    Examples
    --------
    >>> Stroke.parse("330,220:360,240/4")
    Stroke(points=((330.0, 220.0), (360.0, 240.0)), radius_px=4.0)
    >>> str(Stroke(points=[(321, 200)]))
    '321,200'
    """

    points: tuple[tuple[float, float], ...]
    cable: bool = True
    radius_px: float = 2.0

    def __post_init__(self) -> None:
        given = self.points
        pairs = _items(given)
        valid = 0 < len(pairs) <= _MAX_POINTS
        points = tuple(_as_point(pair) for pair in pairs) if valid else ()
        expected = f"1 to {_MAX_POINTS} points (x, y), in pixels"
        require(valid and all(point is not None for point in points), "points", expected, given)
        require(isinstance(self.cable, bool), "cable", "True or False", self.cable)
        msgspec.structs.force_setattr(self, "points", points)
        keep_number(self, "radius_px", 0.5, 1000.0)

    def __str__(self) -> str:
        """Return the notation that `parse` reads."""
        line = ":".join(f"{x:.8g},{y:.8g}" for x, y in self.points)
        return line if self.radius_px == _USUAL_RADIUS_PX else f"{line}/{self.radius_px:.8g}"

    @classmethod
    def parse(cls, text: str, *, cable: bool = True, radius_px: float | None = None) -> Stroke:
        """Read ``"X,Y[:X,Y...][/RADIUS]"``, as the command line and the configuration have it.

        Raises
        ------
        ConfigError
            If the text has another form, or a number is out of range.
        """
        line, slash, radius = text.partition("/") if isinstance(text, str) else ("", "", "")
        parts = [part.split(",") for part in line.split(":")]
        try:
            points = tuple((float(x), float(y)) for x, y in parts)
            width = float(radius) if slash else _USUAL_RADIUS_PX if radius_px is None else radius_px
        except ValueError:
            raise ConfigError(f"expected a stroke {_FORM}, got {shown(text)}") from None
        return cls(points=points, cable=cable, radius_px=width)


_USUAL_RADIUS_PX: float = msgspec.structs.fields(Stroke)[2].default


class ColourPicture(Section, frozen=True, kw_only=True):
    """Strokes on one picture, and the colours that they were drawn on.

    Parameters
    ----------
    source : str
        Origin of the picture, for people to find it again.
    size : (int, int)
        Rows and columns of the picture.
    cable, ground : tuple of str
        Strokes on cables, and on what is none, as ``"X,Y:X,Y"``; after a slash half their width in pixels.
    sample : str
        Colours beneath the strokes and in the rest of the picture, counted; the model is fitted to it without the
        picture. Written by `dloftbs colour`.
    pixels : str
        Features of some pixels of cables and ground, in the same way; empty where no stroke shows how wide a cable is,
        and in files of earlier versions: then the colour alone decides.
    """

    source: str = ""
    size: tuple[int, int]
    cable: tuple[str, ...]
    ground: tuple[str, ...] = ()
    sample: str
    pixels: str = ""

    def __post_init__(self) -> None:
        require(isinstance(self.source, str), "source", "text", self.source)
        for name in ("sample", "pixels"):
            given = getattr(self, name)
            require(isinstance(given, str), name, "text, as `dloftbs colour` writes it", given)
        keep_size(self, "size", MAX_PX)
        for name in ("cable", "ground"):
            given = getattr(self, name)
            valid = isinstance(given, tuple) and all(isinstance(text, str) for text in given)
            require(valid, name, "a tuple of strokes as text, such as ('330,220:360,240',)", given)
        _ = self.strokes  # reads each

    @property
    def strokes(self) -> tuple[Stroke, ...]:
        """The strokes, those on cables first."""
        named = ((True, self.cable), (False, self.ground))
        return tuple(Stroke.parse(text, cable=cable) for cable, texts in named for text in texts)


class ColourConfig(Section, frozen=True, kw_only=True):
    """Colours of cables, learned from strokes that somebody drew.

    Parameters
    ----------
    pictures : tuple of ColourPicture
        The pictures that were drawn on, one or several.
    accept_strokes : bool
        Every colour beneath strokes on cables is the cable's, unless strokes on the ground show more of it. By default
        colours of which the rest of the picture has more are left out: a stroke may reach over the cable's border.
    follow_light : bool
        In a stream, light that drifts is followed where tracks confirm the colours, slowly and within bounds.
    """

    pictures: tuple[ColourPicture, ...]
    accept_strokes: bool = False
    follow_light: bool = True

    def __post_init__(self) -> None:
        given = self.pictures
        valid = isinstance(given, tuple) and all(isinstance(picture, ColourPicture) for picture in given)
        require(valid and 0 < len(given) <= _MAX_PICTURES, "pictures", "a tuple of ColourPicture, at least one", given)
        require(isinstance(self.accept_strokes, bool), "accept_strokes", "true or false", self.accept_strokes)
        require(isinstance(self.follow_light, bool), "follow_light", "true or false", self.follow_light)
        strokes = any(picture.cable for picture in given)
        require(strokes, "pictures", "of which one has a stroke on a cable at least", given)


def _as_point(pair: object) -> tuple[float, float] | None:
    """Return two numbers as a point; None for all else."""
    numbers = [as_float(number) for number in _items(pair)]
    known = [number for number in numbers if number is not None and abs(number) <= MAX_PX]
    return (known[0], known[1]) if len(known) == len(numbers) == 2 else None


def _items(value: object) -> list[object]:
    """Return what is in a list, a tuple or an array; nothing for all else."""
    if isinstance(value, (list, tuple)):
        return list(value)
    listed = value.tolist() if callable(getattr(value, "tolist", None)) else None  # type: ignore[attr-defined]  # asked for
    return listed if isinstance(listed, list) else []
