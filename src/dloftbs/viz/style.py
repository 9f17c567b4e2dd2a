"""Style of the pictures: every colour and every size, in one place."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace

from dloftbs.errors import InputError
from dloftbs.support.values import MAX_PX, MAX_WHOLE, abridged, as_float, check_integer, check_size

Colour = tuple[int, int, int]
"""Blue, green, red, each in 0..255, as OpenCV takes them."""

# Okabe and Ito's colours, distinguished by colour-blind readers too; the dark ones lightened, for dark photographs.
PALETTE: tuple[Colour, ...] = (
    (233, 180, 86),  # sky blue
    (0, 159, 230),  # orange
    (143, 195, 31),  # bluish green
    (192, 139, 224),  # pink
    (66, 228, 240),  # yellow
    (32, 90, 235),  # vermilion
    (255, 125, 76),  # blue
    (235, 235, 235),  # white
)
_REFERENCE_SIDE = 1280
# Below this scale lines and letters would fall apart.
_MIN_SCALE = 0.6
_LENGTHS = ("line_px", "halo_px", "dash_px", "arrow_px", "arrow_spacing_px", "marker_px", "text_px")


@dataclass(frozen=True, repr=False)
class Style:
    """Colours, ``(blue, green, red)`` in 0..255, and sizes, for a picture whose longer side is 1280 px.

    In other pictures the sizes (`panel_px` excepted) grow and shrink with the longer side, but not below 0.6 of these.

    Parameters
    ----------
    palette : tuple of colours
        By track id, or by the order of the detections; it repeats.
    ink : colour
        Dark: halos, plates, and the background of a mask without an image.
    paper : colour
        Light: text on dark plates.
    background : colour
        Of sheets, between the pictures.
    mask : colour
        Mask pixels where there is no image to show.
    changed : colour
        Pixels that cleaning removed.
    line_px : float
        Width of a curve; where the object is thin, at most a third of the object's width.
    halo_px : float
        Width of the dark rim of everything drawn.
    halo_opacity : float
        In 0..1.
    dash_px : float
        Length of a dash where a curve was inferred.
    arrow_px, arrow_spacing_px : float
        Length of the direction arrows, and the arc length from one to the next.
    marker_px : float
        Radius of the markers at ends and crossings.
    text_px : float
        Height of a capital letter.
    panel_px : int
        Longer side of a panel of `draw_3d`, and of `draw_stages` about: there pixels are enlarged by whole factors.

    Raises
    ------
    InputError
        If a colour or a size is out of its range.
    """

    palette: tuple[Colour, ...] = PALETTE
    ink: Colour = (26, 22, 20)
    paper: Colour = (240, 240, 240)
    background: Colour = (58, 54, 52)
    mask: Colour = (120, 116, 112)
    changed: Colour = (70, 90, 240)
    line_px: float = 2.4
    halo_px: float = 1.4
    halo_opacity: float = 0.7
    dash_px: float = 9.0
    arrow_px: float = 8.0
    arrow_spacing_px: float = 130.0
    marker_px: float = 5.5
    text_px: float = 12.0
    panel_px: int = 720

    def __post_init__(self) -> None:
        if not isinstance(self.palette, tuple) or not self.palette:
            raise InputError(f"palette must be a tuple of one colour or more, got {self.palette!r}")
        for colour in (*self.palette, self.ink, self.paper, self.background, self.mask, self.changed):
            if not _is_colour(colour):
                raise InputError(f"a colour must be three integers in 0..255 (blue, green, red), got {colour!r}")
        check_integer("panel_px", self.panel_px, 1, MAX_PX)
        for name in _LENGTHS:
            if not (_is_finite(getattr(self, name)) and getattr(self, name) > 0):
                raise InputError(f"{name} must be a positive number, got {getattr(self, name)!r}")
        if not (_is_finite(self.halo_opacity) and 0.0 <= self.halo_opacity <= 1.0):
            raise InputError(f"halo_opacity must be a number in 0..1, got {self.halo_opacity!r}")

    def __repr__(self) -> str:
        values = {part.name: getattr(self, part.name) for part in fields(self)}
        changed = [f"{part.name}={values[part.name]}" for part in fields(self) if values[part.name] != part.default]
        return abridged(f"Style({', '.join(changed)})")

    def colour(self, order: int) -> Colour:
        """Return the palette's colour number `order`, from 0 on, again and again."""
        return self.palette[check_integer("order", order, 0, MAX_WHOLE) % len(self.palette)]

    def scaled(self, size: tuple[int, ...]) -> Style:
        """Return the style with its sizes as they are in a picture of `size` ``(H, W, ...)``."""
        longer = max(check_size("size", size[:2] if isinstance(size, tuple) else size))
        scale = max(_MIN_SCALE, longer / _REFERENCE_SIDE)
        return replace(self, **{name: getattr(self, name) * scale for name in _LENGTHS})


def dimmed(colour: Colour, towards: Colour, share: float) -> Colour:
    """Return a mixture of two colours: `share` of the second."""
    b, g, r = (round(a + (z - a) * share) for a, z in zip(colour, towards, strict=True))
    return b, g, r


def as_css(colour: Colour) -> str:
    """Return a colour as a style sheet or an SVG writes it."""
    blue, green, red = colour
    return f"#{red:02x}{green:02x}{blue:02x}"


def is_light(colour: Colour) -> bool:
    """Return whether dark text reads better on the colour than light text."""
    blue, green, red = colour
    return 0.114 * blue + 0.587 * green + 0.299 * red > 110.0  # ITU-R BT.601 luma


def _is_finite(value: object) -> bool:
    return as_float(value) is not None


def _is_colour(value: object) -> bool:
    return (
        isinstance(value, tuple)
        and len(value) == 3
        and all(isinstance(c, int) and not isinstance(c, bool) and 0 <= c <= 255 for c in value)
    )
