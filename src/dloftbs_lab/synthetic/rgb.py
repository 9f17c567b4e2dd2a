"""Colour images of a cable that two grippers hold, with the mask that its hue gives."""

from __future__ import annotations

from functools import cached_property

import cv2
import numpy as np
import numpy.typing as npt

from dloftbs.config import HsvRange
from dloftbs.data.frame import Frame
from dloftbs.errors import InputError
from dloftbs_lab.synthetic.generated import GeneratedSequence, check_choice, count_at, proportion
from dloftbs_lab.synthetic.rgb_scenes import SCENARIOS, HeldScene
from dloftbs_lab.synthetic.sketch import Image
from dloftbs_lab.synthetic.strand import Strand
from dloftbs_lab.synthetic.studio import DYES, HSV, Studio
from dloftbs_lab.truth import Truth

RGB_SCENARIOS = tuple(SCENARIOS)
"""The scenarios of `RgbSequence`."""

_FRAMES = {name: 126 if name == "self-intersection, occluded" else 129 for name in RGB_SCENARIOS}
_SECONDS = 4.3


class RgbSequence(GeneratedSequence):
    """A cable on a workbench that two grippers hold, and move for 4.3 s until all is as in the beginning.

    Frames have the image and the mask of its colour, which has the noise of a real segmentation: highlights, shadows
    and the camera's noise.

    Parameters
    ----------
    scenario : str
        One of `RGB_SCENARIOS`; the sequence is named by its number and the scenario.
    frames : int
        With fewer frames the same motion is seen in larger steps.
    size, seed
        As `GeneratedSequence` has them; another seed gives another bench and another motion.
    width_px : float, optional
        Width of the cable; where it is left out, the scenario's, in proportion to the size.

    Raises
    ------
    InputError
        If a value is out of range, or the cable too wide to bend in an image of this size.
    """

    def __init__(
        self,
        scenario: str = "plain",
        frames: int = 129,
        size: tuple[int, int] = (720, 1280),
        seed: int = 0,
        width_px: float | None = None,
    ) -> None:
        check_choice("scenario", scenario, RGB_SCENARIOS)
        number = RGB_SCENARIOS.index(scenario)
        super().__init__(f"{number} {scenario}", frames, size, seed, max(1, frames) / _SECONDS)
        self.scenario = scenario
        self.width_px = SCENARIOS[scenario].width_px * proportion(size) if width_px is None else width_px
        if not self.width_px >= 1.0:
            raise InputError(f"width_px must be at least 1, got {self.width_px}")
        self._color = number % len(DYES)
        # Each scenario has a bench of its own.
        self._drawn_seed = len(RGB_SCENARIOS) * seed + number
        # What cannot be is refused here, not at the first frame.
        _ = self._scene.motion

    @property
    def hsv(self) -> tuple[HsvRange, ...]:
        """The colour of the cable: what `SegmentationConfig.hsv` takes."""
        return (HSV[self._color],)

    def _make_frame(self, index: int) -> Frame:
        """Render one frame: image (H, W, 3) BGR and mask (H, W) bool."""
        strand = self._strand(index)
        actors = self._scene.actors(strand, index / self._frames)
        image = self._studio.shoot((strand,), (DYES[self._color],), actors, index)
        return Frame(image=image, mask=segment(image, HSV[self._color]), **self._labels(index))

    def _make_truth(self, index: int) -> Truth:
        strand = self._strand(index)
        actors = self._scene.actors(strand, index / self._frames)
        return Truth((strand.curve(),), self._studio.visible((strand,), actors), (0,))

    def _strand(self, index: int) -> Strand:
        return self._scene.motion.strand(index / self._frames)

    @cached_property
    def _scene(self) -> HeldScene:
        return HeldScene(SCENARIOS[self.scenario], self._drawn_seed, self.size, self.width_px)

    @cached_property
    def _studio(self) -> Studio:
        return Studio(self._drawn_seed, self.size, self.width_px)


def segment(image: Image, hsv: HsvRange) -> npt.NDArray[np.bool_]:
    """Return where `image` (H, W, 3) has a colour within a range that does not wrap around, shape (H, W)."""
    low, high = zip(hsv.hue, hsv.saturation, hsv.value, strict=True)
    return np.asarray(cv2.inRange(cv2.cvtColor(image, cv2.COLOR_BGR2HSV), low, high)).view(bool)


def rgb(scale: float = 1.0, seed: int = 0, size: tuple[int, int] = (720, 1280)) -> list[RgbSequence]:
    """Return a sequence of each of the `RGB_SCENARIOS`, 900 frames in all, by the scale; none has less than 3."""
    return [RgbSequence(name, count_at(scale, full, 3), size, seed) for name, full in _FRAMES.items()]
