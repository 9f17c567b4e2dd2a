"""Section of the cleaning."""

from __future__ import annotations

import msgspec

from dloftbs.config.section import MAX, Section, keep_integer, require
from dloftbs.support.values import as_integer


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
        Least number of pixels of a cable of one or two pixels, which comes back after the opening took it: connected,
        or dashes in line. Salt does not come back, nor do threads within the edge of a much thicker cable. 0, the
        paper's, brings nothing back.
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
            require(valid, name, "an odd integer in 1..99", getattr(self, name))
            msgspec.structs.force_setattr(self, name, side)
        keep_integer(self, "thin_px", 0, MAX)
        require(isinstance(self.fill_holes, bool), "fill_holes", "true or false", self.fill_holes)
