"""Labels for training in COCO's form: a mask of each object, all in one file."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from dloftbs.data.curve_pixels import curve_mask
from dloftbs.data.frame import Frame
from dloftbs.data.frame_result import FrameResult
from dloftbs.data.run_lengths import encode as run_lengths
from dloftbs.sinks._seen import CATEGORY, SeenObject, seen_objects
from dloftbs.sinks.sink import PathSink
from dloftbs.support.arrays import as_bytes
from dloftbs.support.json_text import encode
from dloftbs.support.safe_files import claim_replaceable, sink_errors, write_whole
from dloftbs.support.text import readable


class CocoSink(PathSink):
    """Writes the masks of all objects into one .json in COCO's form, as training data for a segmentation network.

    ``images`` has an entry for each frame, in order: ``id`` from 1, ``file_name``, ``width``, ``height``. The name is
    the frame's, as ``photo.png`` or ``video.mp4#12``; without one it is the frame's index in six digits. Sources name
    files of one name by their folders, too: ``day1/photo.png``.

    ``annotations`` has an entry for each object in a frame: a result's tracks, or its detections where it has none.
    Each has ``id`` from 1, ``image_id``, ``category_id``, ``iscrowd`` 0, ``area`` in pixels, ``bbox`` ``[x, y, width,
    height]``, and ``track_id``, in files with tracks. ``segmentation`` holds the mask as compressed run lengths. It is
    the object's curve, drawn with its width. Parts that the frame does not show are not in the mask: those across a gap
    of the input's mask and those that a track remembers. Where objects cross, the pixels are in the masks of both.
    Objects without a pixel in the image are left out.

    ``categories`` has the one entry ``{"id": 1, "name": "cable"}``.

    All labels stay in memory until `close` writes the file, as a whole or not at all, also where an exception ends the
    block. A process that is killed before leaves no file, or the older one as it was.

    Parameters
    ----------
    path : str or Path
        The file; missing folders are made, an older file is replaced, unless no frame came.

    Raises
    ------
    SinkError
        If the file cannot be written.
    """

    def __init__(self, path: str | Path) -> None:
        super().__init__(path)
        self._images: list[dict[str, Any]] = []
        self._annotations: list[dict[str, Any]] = []
        self._claim = claim_replaceable(self._path)

    def _write(self, frame: Frame, result: FrameResult) -> None:
        height, width = result.size
        image_id = len(self._images) + 1
        labels = [label for seen in seen_objects(result) for label in _labels_of(seen, result.size)]
        name = readable(result.name) or f"{result.index:06d}"
        self._annotations += [
            {"id": number, "image_id": image_id, "category_id": 1, **label}
            for number, label in enumerate(labels, start=len(self._annotations) + 1)
        ]
        self._images.append({"id": image_id, "file_name": name, "width": width, "height": height})

    def _close(self) -> None:
        categories = [{"id": 1, "name": CATEGORY}]
        content = {"images": self._images, "annotations": self._annotations, "categories": categories}
        with self._claim, sink_errors(self._path):
            if not self._keeps_older:
                write_whole(self._path, encode(content))


def _labels_of(seen: SeenObject, size: tuple[int, int]) -> list[dict[str, Any]]:
    """Return the label of an object, or none where it has no pixel in the image."""
    import cv2

    mask = curve_mask(seen.curve, seen.width_px, size, seen.spans)
    if not mask.any():
        return []
    label = {
        "segmentation": run_lengths(mask),
        "area": int(mask.sum()),
        "bbox": list(cv2.boundingRect(as_bytes(mask))),
        "iscrowd": 0,
    }
    return [label | {"track_id": seen.row.track_id} if seen.row.track_id else label]
