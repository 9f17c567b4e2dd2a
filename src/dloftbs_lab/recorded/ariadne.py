"""Photographs of cables with coarse points along each, as in the data set of Ariadne (De Gregorio et al., 2018)."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from dloftbs.data.frame import Frame
from dloftbs.errors import InputError, source_errors
from dloftbs.sources.image_files import IMAGE_EXTENSIONS
from dloftbs.sources.pixel_values import read_mask
from dloftbs.support.arrays import FloatArray
from dloftbs_lab.recorded.label_images import paired
from dloftbs_lab.recorded.layout import Layout, RecordedSequence, files_in
from dloftbs_lab.recorded.pictures import by_stem, images_in, photograph
from dloftbs_lab.recorded.through_points import truth_of
from dloftbs_lab.truth import Truth

TREE = """\
ariadne: photographs of cables, as the data set of Ariadne has them
  folder/
    00004.jpg             any image format
    00004_mask_all.png    all cables; 00004_mask_0.png and so on, of single ones, are not read
    00004.txt             a line per cable: the number of its points, then x y of each"""

MASK = "_mask_all.png"
TOLERANCE_PX = 10.0
"""Error of the annotated points."""
_MASK_NAME = re.compile(r".*_mask_(all|\d+)")
_MIN_NUMBERS = 5  # a count and two points


class AriadneImages(RecordedSequence):
    """Photographs with the mask of all cables, and the spline through the points of each.

    Parameters
    ----------
    folder : Path

    Raises
    ------
    SourceError
        If two images have one stem, or a mask is without its image or, when its truth is asked for, without its points.
        Images without a mask are left out, with a warning.
    """

    tolerance_px = TOLERANCE_PX

    def __init__(self, folder: Path) -> None:
        images = by_stem(path for path in images_in(folder) if not _MASK_NAME.fullmatch(path.stem))
        stems = [path.name.removesuffix(MASK) for path in files_in(folder) if path.name.endswith(MASK)]
        truths = {stem: folder / f"{stem}.txt" for stem in stems}
        self._pairs = paired(folder, images, truths, f"an image {'|'.join(IMAGE_EXTENSIONS)}")
        super().__init__(folder, len(self._pairs))

    def _frame(self, index: int) -> Frame:
        path = self._pairs[index][0]
        mask = read_mask(path.with_name(path.stem + MASK))
        return Frame(photograph(path, mask.shape), mask, index=index, name=path.name)

    def _truth(self, index: int) -> Truth:
        path = self._pairs[index][1]
        with source_errors(path, (OSError, UnicodeDecodeError)):
            lines = path.read_text("utf-8").splitlines()
        with source_errors(path, InputError):
            return truth_of([_points(number, line) for number, line in enumerate(lines, start=1) if line.strip()])


def _points(number: int, line: str) -> FloatArray:
    """Return the points (n, 2) of a line."""
    try:
        values = np.array(line.split(), dtype=np.float64)
    except ValueError as error:
        raise InputError(f"line {number} must hold numbers: {error}") from error
    if len(values) < _MIN_NUMBERS or len(values) != 1 + 2 * values[0]:
        raise InputError(f"line {number} must have a count n of at least 2 and 2 n numbers, got {line[:40]!r}")
    return values[1:].reshape(-1, 2)


def _fits(folder: Path) -> bool:
    return any(path.name.endswith(MASK) for path in files_in(folder))


LAYOUT = Layout("ariadne", TREE, _fits, AriadneImages)
