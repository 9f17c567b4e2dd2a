"""Letters in pictures."""

from __future__ import annotations

import textwrap
from dataclasses import dataclass

import cv2

from dloftbs.support.text import readable
from dloftbs.viz.shapes import Picture
from dloftbs.viz.style import Colour

_FONT = cv2.FONT_HERSHEY_SIMPLEX
# A capital letter of the font is 21 px high at scale 1.
_CAPITAL_PX = 21.0
# From this height on a stroke of one pixel looks thin.
_BOLD_FROM_PX = 14.0


@dataclass(frozen=True)
class Text:
    """One line of text at a size.

    Parameters
    ----------
    text : str
    capital_px : float
        Height of a capital letter.
    """

    text: str
    capital_px: float

    @property
    def _letters(self) -> str:
        return readable(self.text)  # OpenCV crashes on what is no Unicode

    @property
    def _scale(self) -> float:
        return self.capital_px / _CAPITAL_PX

    @property
    def _thickness(self) -> int:
        return max(1, round(self.capital_px / _BOLD_FROM_PX))

    @property
    def pad(self) -> int:
        """Room around the letters on a plate, px."""
        return max(2, round(0.4 * self.capital_px))

    @property
    def size(self) -> tuple[int, int]:
        """Width and height of the plate, px."""
        (width, _), _ = cv2.getTextSize(self._letters, _FONT, self._scale, self._thickness)
        return width + 2 * self.pad, round(self.capital_px) + 2 * self.pad

    def write(self, picture: Picture, left: int, top: int, colour: Colour) -> None:
        """Write the text, without its plate, into the picture; `left` and `top` are the plate's."""
        origin = (left + self.pad, top + self.pad + round(self.capital_px))
        cv2.putText(picture, self._letters, origin, _FONT, self._scale, colour, self._thickness, cv2.LINE_AA)

    def shortened(self, width: int) -> Text:
        """Return the text with its end cut off, so that its plate is at most `width` px wide."""
        if self.size[0] <= width:
            return self
        for n in range(len(self.text) - 1, 0, -1):
            short = Text(self.text[:n].rstrip() + "...", self.capital_px)
            if short.size[0] <= width:
                return short
        return Text("", self.capital_px)


def wrapped(text: str, capital_px: float, width: int) -> list[Text]:
    """Break a text into lines whose plates are about `width` px wide."""
    letter = max(1.0, (Text(text, capital_px).size[0] - 2 * Text(text, capital_px).pad) / max(len(text), 1))
    letters = max(8, int((width - 2 * Text(text, capital_px).pad) / letter))
    return [Text(part, capital_px) for part in textwrap.wrap(text, letters)]


def note(picture: Picture, text: str, capital_px: float, colour: Colour, plate: Colour) -> None:
    """Write a remark on a dark plate into the lower left corner."""
    lines = [part.shortened(picture.shape[1]) for part in wrapped(text, capital_px, int(0.9 * picture.shape[1]))]
    width = max((part.size[0] for part in lines), default=0)
    step = max((part.size[1] - part.pad // 2 for part in lines), default=0)
    top = max(0, picture.shape[0] - step * len(lines) - (lines[0].pad // 2 if lines else 0))
    picture[top:, :width] = plate
    for i, part in enumerate(lines):
        part.write(picture, 0, top + i * step, colour)
