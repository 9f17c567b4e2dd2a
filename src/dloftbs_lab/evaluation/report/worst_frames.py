"""The worst frames of a run, drawn: whether they are bad frames or errors of the measurement is for eyes to say."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path

import cv2
import numpy as np

from dloftbs import viz
from dloftbs.data.centerline import Centerline, Segment, arc_parameter
from dloftbs.data.curve import BSplineCurve
from dloftbs.data.detection import Detection
from dloftbs.data.frame import Frame
from dloftbs.data.frame_result import FrameResult
from dloftbs.support.arrays import FloatArray
from dloftbs.support.safe_files import write_whole
from dloftbs.viz.overlay import as_picture
from dloftbs.viz.shapes import Picture
from dloftbs_lab.evaluation.report.picture_names import stem_of
from dloftbs_lab.evaluation.runner.finished_parts import FrameRow, Part, Points
from dloftbs_lab.evaluation.runner.found import samples
from dloftbs_lab.evaluation.runner.sequence_run import WORST
from dloftbs_lab.evaluation.suites import Suite
from dloftbs_lab.truth import Truth

_TRUTH = (255, 255, 255)
_TRUTH_SHARE = 0.8
_MASK = (90, 200, 90)
_MASK_SHARE = 0.45
_DIMMED = 0.55
_TILE_PX = 640
_JPEG_QUALITY = 82


def write_worst(suites: Sequence[Suite], parts: Sequence[Part], folder: Path) -> list[Path]:
    """Draw the worst frames of each suite and method on a sheet, the worst first.

    White casings run along the true curves, and what was found lies between them in colour; the mask that the method
    was given is grey, or green where there is an image.

    Returns
    -------
    list of Path
        Of the sheets, JPEG.

    Raises
    ------
    SinkError
        If a sheet cannot be written.
    """
    paths = []
    for suite in suites:
        for method in dict.fromkeys(part.key.method for part in parts):
            mine = [part for part in parts if part.key.suite == suite.name and part.key.method == method]
            frames = list(_worst(mine))
            if not frames:
                continue
            pictures = [_draw(suite, part, row) for part, row in frames]
            sheet = viz.contact_sheet(pictures, [_title(row) for _, row in frames], columns=2, tile_width=_TILE_PX)
            paths.append(folder / f"{stem_of(suite.name, method)}.jpg")
            _, data = cv2.imencode(".jpg", sheet, [cv2.IMWRITE_JPEG_QUALITY, _JPEG_QUALITY])
            write_whole(paths[-1], data.tobytes())
    return paths


def _worst(parts: Sequence[Part]) -> Iterator[tuple[Part, FrameRow]]:
    """Yield the worst frames of a suite, which are among the worst of its sequences."""
    kept = [(part, row) for part in parts for row in part.rows if row.index in part.worst]
    yield from sorted(kept, key=lambda pair: pair[1].badness, reverse=True)[:WORST]


def _title(row: FrameRow) -> str:
    seed = row.scene.rpartition(", ")[2]
    where = f"{row.sequence}{f', {seed}' if seed.startswith('seed ') else ''} #{row.index}"
    if row.failure is not None:
        return f"{where}: {row.failure}"
    what = ["no L3" if row.l3_px is None else f"L3 {row.l3_px:.1f} px"]
    what += [f"{count} {name}" for name, count in (("missing", row.missing), ("redundant", row.redundant)) if count]
    what += [] if row.dice is None else [f"DICE {row.dice:.2f}"]
    return f"{where}: {', '.join(what)}"


def _draw(suite: Suite, part: Part, row: FrameRow) -> Picture:
    sequence = suite.sequences[part.key.number]
    frame = sequence.frame(row.index)
    picture = _ground(frame)
    _draw_truth(picture, sequence.truth(row.index))
    curves = [_curve(points) for points in part.worst[row.index] if len(set(points)) > 1]
    found = tuple(Detection(_centerline(curve.control_points), curve) for curve in curves)
    return viz.draw(picture, FrameResult(found, (), row.failure, frame.size))


def _ground(frame: Frame) -> Picture:
    """Return the dimmed picture of a frame, with its mask on it."""
    picture = as_picture(frame, viz.Style())
    mask = frame.is_cable
    if frame.image is None or mask is None:
        return picture
    picture = cv2.convertScaleAbs(picture, alpha=_DIMMED).astype(np.uint8, copy=False)
    tinted = (1.0 - _MASK_SHARE) * picture[mask] + _MASK_SHARE * np.array(_MASK)
    picture[mask] = tinted.astype(np.uint8)
    return picture


def _draw_truth(picture: Picture, truth: Truth) -> None:
    """Draw a casing along the true curves: what lies within it stays to be seen."""
    border = max(2, round(max(picture.shape) / 400))
    casing = np.zeros(picture.shape[:2], np.uint8)
    for width, value in ((5 * border, 255), (3 * border, 0)):
        for curve in truth.curves:
            points = np.rint(16.0 * samples(curve)).astype(np.int32)
            cv2.polylines(casing, [points], False, value, width, cv2.LINE_AA, 4)
    share = _TRUTH_SHARE * casing[..., None] / 255.0
    picture[:] = ((1.0 - share) * picture + share * np.array(_TRUTH)).astype(np.uint8)


def _curve(points: Points) -> BSplineCurve:
    """Return a line through points as a curve of the first degree."""
    line = np.array(points, dtype=np.float64)
    line = line[np.concatenate(([True], np.any(np.diff(line, axis=0) != 0.0, axis=1)))]  # a short one repeats points
    u = arc_parameter(line)
    return BSplineCurve(np.concatenate(([0.0], u, [1.0])), line, 1)


def _centerline(points: FloatArray) -> Centerline:
    return Centerline((Segment(points, np.full(len(points), 1e3)),))
