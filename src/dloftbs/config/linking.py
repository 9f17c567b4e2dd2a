"""Sections of the linking, one for each method."""

from __future__ import annotations

from dloftbs.config.section import MAX, Section, keep_integer, keep_number, require
from dloftbs.errors import ConfigError


class ObjectsConfig(Section, frozen=True, kw_only=True):
    """Selection of the centre lines that are objects: the base of all linking sections.

    Parameters
    ----------
    objects : int or None
        Number of objects, where it is known. The default method joins the pieces of more to so many, across gaps of
        any length, so that bends, gaps and what is left out cost the least; with 1 all pieces that are no dirt become
        one curve. What is left out is reported in `FrameResult.dropped`. The published method keeps the longest. Where
        fewer were found, they stay. None: as many as there seem to be.
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
            keep_integer(self, "objects", 1, MAX)
        keep_integer(self, "min_length_px", 0, MAX)
        keep_number(self, "min_length_widths", 0.0, MAX)


class LinkingConfig(ObjectsConfig, frozen=True, kw_only=True, tag_field="method", tag="bending"):
    """Segments to centre lines, by what bends least; lengths are in widths of the cable.

    Parameters
    ----------
    objects, min_length_px, min_length_widths
        As for `ObjectsConfig`.
    max_gap_widths : float
        Longest gap that is bridged, unless a known number of objects asks for a longer one.
    min_gap_confidence : float
        Least probability of a gap that is bridged, in 0..1; less probable ones are reported as
        `Detection.near_joints`. A known number of objects may ask for them all the same. At 0 all gaps are bridged
        that cost less than two open ends.
    min_probability : float
        Least probability to be a cable at all of an object that is a detection, in 0..1; less probable ones, such as
        debris beside a cable, are reported in `FrameResult.dropped`. A known number of objects takes its place.
    branched : bool
        Whether objects may branch, as wiring harnesses do: where three or more ends of cables meet, they may be one
        branch point, as `FrameResult.branch_points` lists them. A known number of objects cannot be stated beside it.
    """

    max_gap_widths: float = 25.0
    min_gap_confidence: float = 0.5
    min_probability: float = 0.33
    branched: bool = False

    def __post_init__(self) -> None:
        super().__post_init__()
        keep_number(self, "max_gap_widths", 0.0, MAX)
        keep_number(self, "min_gap_confidence", 0.0, 1.0)
        keep_number(self, "min_probability", 0.0, 1.0)
        require(isinstance(self.branched, bool), "branched", "true or false", self.branched)
        if self.branched and self.objects is not None:
            raise ConfigError(
                f"linking.objects = {self.objects} counts cables that do not branch, and linking.branched says that "
                "they do: leave out one of them"
            )


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
        keep_integer(self, "min_length_px", 2, MAX)
        keep_number(self, "distance_weight", 0.0, 1.0)
        if self.max_cost is not None:
            keep_number(self, "max_cost", 0.0, MAX)
        keep_integer(self, "direction_px", 2, MAX)
