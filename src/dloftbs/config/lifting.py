"""Sections of the lifting, one for each method."""

from __future__ import annotations

from dloftbs.config.section import MAX, MIN, Section, keep_number, require

NEAREST_M, FARTHEST_M = 1e-30, 1e30
"""Depth that is read at all, metres: it, its reciprocal and the squares and cubes of both are numbers and not 0, the
former two in float32 as well. Far beyond any sensor; a greater stored value is no depth."""


class DepthConfig(Section, frozen=True, kw_only=True):
    """Range of the values of depth images: the base of all lifting sections.

    Parameters
    ----------
    min_depth_m, max_depth_m : float
        Depth outside of this range counts as missing, as 0, NaN and infinity do, and all that is nearer than 1e-30 m or
        farther than 1e30 m.
    """

    min_depth_m: float = 0.0
    max_depth_m: float = 20.0

    def __post_init__(self) -> None:
        keep_number(self, "min_depth_m", 0.0, MAX)
        keep_number(self, "max_depth_m", MIN, MAX)
        limits = (self.min_depth_m, self.max_depth_m)
        require(limits[0] < limits[1], "min_depth_m, max_depth_m", "numbers with min < max", limits)

    @property
    def range_m(self) -> tuple[float, float]:
        """The nearest and the farthest depth that is read; whatever reads depth takes its range from here."""
        return max(self.min_depth_m, NEAREST_M), min(self.max_depth_m, FARTHEST_M)


class LiftingConfig(DepthConfig, frozen=True, kw_only=True, tag_field="method", tag="axis"):
    """Depth image to metres: the axis of each object, from a robust smooth line along its surface.

    Parameters
    ----------
    min_depth_m, max_depth_m
        As for `DepthConfig`.
    """


class PixelLiftingConfig(DepthConfig, frozen=True, kw_only=True, tag_field="method", tag="pixels"):
    """Depth image to metres, as published: each pixel of a centre line by itself, on the surface.

    Parameters
    ----------
    min_depth_m, max_depth_m
        As for `DepthConfig`.
    """
