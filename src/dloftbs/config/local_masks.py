"""Sections of masks that compare a pixel with its surroundings, or with the same place without cables."""

from __future__ import annotations

from dloftbs.config.section import Section, keep_number, require

_TONES = ("darker", "brighter")
"""Sides of the surroundings that a cable may be on."""
_JOINS = ("and", "or")
"""Ways in which a mask is joined with those of colours and networks."""

_MAX_WIDTH_PX = 1000.0
_LEVELS = 255.0


class LocalConfig(Section, frozen=True, kw_only=True):
    """Pixels that are darker, or brighter, than what surrounds them.

    Parameters
    ----------
    tone : "darker" or "brighter"
        What the cables are, compared with the ground beside them.
    width_px : float or None
        Width of the widest cable, in pixels of the image. Thinner cables are found as well; those three times as wide
        are lost. None: a fortieth of the image's shorter side.
    contrast : float or None
        Least difference from the surroundings, in levels of 255. None: by the image's noise and texture.
    join : "and" or "or"
        With a colour or a network beside it: whether a pixel must be found by both, or by one of them.
    """

    tone: str
    width_px: float | None = None
    contrast: float | None = None
    join: str = "and"

    def __post_init__(self) -> None:
        require(isinstance(self.tone, str) and self.tone in _TONES, "tone", "'darker' or 'brighter'", self.tone)
        if self.width_px is not None:
            keep_number(self, "width_px", 1.0, _MAX_WIDTH_PX)
        keep_contrast(self)
        keep_join(self)


class BackgroundConfig(Section, frozen=True, kw_only=True):
    """Pixels that differ from a picture of the same place without cables, by a camera that stands still.

    Parameters
    ----------
    file : str
        Path of the picture, of the frames' size, as `dloftbs background` writes it; or a .npy file (H, W, 3), BGR.
    contrast : float or None
        Least difference from the background, in levels of 255. None: by the noise of the frame.
    join : "and" or "or"
        With a colour or a network beside it: whether a pixel must be found by both, or by one of them.
    """

    file: str
    contrast: float | None = None
    join: str = "and"

    def __post_init__(self) -> None:
        keep_file(self, "the path of a picture, in UTF-8")
        keep_contrast(self)
        keep_join(self)


def keep_contrast(section: LocalConfig | BackgroundConfig) -> None:
    """Check a least contrast, and keep it as a float."""
    if section.contrast is not None:
        keep_number(section, "contrast", 1.0, _LEVELS)


def keep_join(section: Section) -> None:
    """Check the way in which a mask is joined with others."""
    join = section.join  # type: ignore[attr-defined]  # of those sections alone that have one
    require(isinstance(join, str) and join in _JOINS, "join", "'and' or 'or'", join)


def keep_file(section: Section, expected: str) -> None:
    """Check a path, which is written to YAML."""
    file = section.file  # type: ignore[attr-defined]  # as above
    valid = isinstance(file, str) and bool(file) and not any("\ud800" <= sign <= "\udfff" for sign in file)
    require(valid, "file", expected, file)
