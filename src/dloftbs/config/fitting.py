"""Section of the fitting."""

from __future__ import annotations

from dloftbs.config.section import MAX, MIN, Section, keep_integer, keep_number


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
            keep_integer(self, "knots", 2, 1000)
        keep_number(self, "tolerance_px", MIN, MAX)
