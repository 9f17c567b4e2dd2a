"""Photographs with label images beside them, as the data set of mBEST (Choi et al., RA-L 2023) is kept here."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

import numpy as np

from dloftbs.data.frame import Frame
from dloftbs.errors import SourceError
from dloftbs.sources.image_files import IMAGE_EXTENSIONS
from dloftbs.sources.pixel_values import read_labels
from dloftbs.sources.source import logger
from dloftbs_lab.recorded.layout import Layout, RecordedSequence, files_in, listed
from dloftbs_lab.recorded.pictures import (
    CAMERA,
    by_stem,
    camera_in,
    depth_beside,
    images_in,
    mask_beside,
    occluders_beside,
    photograph,
)
from dloftbs_lab.truth import Truth

TREE = """\
labels: an image of object numbers (0 is background) for each image; no curves are known
  folder/
    00.jpg                any image format
    00.labels.png         one channel or indexed colour
    00.mask.png           the mask of the frame; without it, all numbered pixels. STEM.depth.png, STEM.occluders.png and
                          camera.json may lie beside, too"""

LABELS = ".labels.png"
_TRUTHS = (LABELS, ".csv", ".json")
"""What may follow the stem of an image in the name of its truth, in natural order."""


class LabelledImages(RecordedSequence):
    """Images, each with the number of the object in every pixel.

    The mask of a frame is STEM.mask.png, or all numbered pixels where there is no such file.

    Parameters
    ----------
    folder : Path

    Raises
    ------
    SourceError
        If labels are without their image, an image has another truth, too, or two images have one stem. Images without
        labels are left out, with a warning.
    """

    def __init__(self, folder: Path) -> None:
        images = by_stem(images_in(folder))
        labels = {path.name.removesuffix(LABELS): path for path in files_in(folder) if path.name.endswith(LABELS)}
        refuse_two_truths(folder, images)
        self._pairs = paired(folder, images, labels, f"an image {'|'.join(IMAGE_EXTENSIONS)}")
        self._camera = camera_in(folder)
        super().__init__(folder, len(self._pairs))

    def _frame(self, index: int) -> Frame:
        path, labels_path = self._pairs[index]
        labels, mask = read_labels(labels_path), mask_beside(path)
        if mask is None:
            mask = labels > 0
        elif mask.shape != labels.shape:
            sizes = f"{mask.shape} and {labels.shape}"
            raise SourceError(
                f"{path}: its mask and its labels must have one size, got {sizes}; draw both on the image"
            )
        image, depth, occluders = photograph(path, mask.shape), depth_beside(path), occluders_beside(path)
        return Frame(image, mask, depth, occluders, self._camera, index=index, name=path.name)

    def _truth(self, index: int) -> Truth:
        labels = read_labels(self._pairs[index][1])
        ids = tuple(int(number) for number in np.unique(labels) if number > 0)
        return Truth((), tuple(labels == number for number in ids), ids)


def refuse_two_truths(folder: Path, images: Iterable[str]) -> None:
    """See that no image, of which the stem is given, has labels and polylines, or two files of either.

    Raises
    ------
    SourceError
        If one has.
    """
    names = {path.name for path in files_in(folder)} - {CAMERA}
    for stem in images:
        truths = [f"{stem}{suffix}" for suffix in _TRUTHS if f"{stem}{suffix}" in names]
        if len(truths) > 1:
            raise SourceError(f"{folder}: {' and '.join(truths)} are the truth of one image; keep one of them")


def paired(folder: Path, images: dict[str, Path], truths: dict[str, Path], wanted: str) -> list[tuple[Path, Path]]:
    """Return each image with its file of truth, by stem, in the order of the images.

    Raises
    ------
    SourceError
        If a truth has no image. An image without truth is left out, with a warning.
    """
    lonely = [path.name for stem, path in truths.items() if stem not in images]
    if lonely:
        raise SourceError(f"{folder}: {len(lonely)} of {len(truths)} lack {wanted} of their name: {listed(lonely)}")
    unknown = [path.name for stem, path in images.items() if stem not in truths]
    if unknown:
        logger.warning("%s: left out %d images without truth: %s", folder, len(unknown), listed(unknown))
    return [(path, truths[stem]) for stem, path in images.items() if stem in truths]


def _fits(folder: Path) -> bool:
    return any(path.name.endswith(LABELS) for path in files_in(folder))


LAYOUT = Layout("labels", TREE, _fits, LabelledImages)
