"""How near both methods come to the curves of the authors' own implementation, and pictures of what they find.

Run it with ``python -m benchmarks.original_curves FOLDER``, where the folder holds masks and ``original_curves.json``:
points (x, y) of the authors' curve by the name of the mask. Prints a table in Markdown. With ``--pictures OUT`` it also
draws each mask with the default method's curves beside the published method's, a PNG a mask; with ``--sheet FILE`` the
default method's curves of all masks, without the masks; ``--page docs/maintainers/authors-masks.md`` brings the figures
of the page's table up to date.
"""

from __future__ import annotations

import argparse
import json
import re
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import numpy.typing as npt
from scipy.spatial import cKDTree

import dloftbs
from dloftbs.viz import contact_sheet, draw
from dloftbs_lab.evaluation import mmd

Points = npt.NDArray[np.float64]
Mask = npt.NDArray[np.uint8]

CONFIGS = {"default": dloftbs.Config(), "paper": dloftbs.Config.paper(objects=1)}
COLUMNS = (
    "mask",
    "default: theirs to ours, px",
    "ours to theirs",
    "farthest",
    "confidence",
    "paper: theirs to ours, px",
    "ours to theirs",
    "farthest",
)
_ROW = re.compile(r"^\| (?P<mask>\d{3}) \|(?: [\d.]+ \|){7} (?P<words>[^|]+) \|$", re.MULTILINE)
_LONGER_SIDE_PX = 1280
_TILE_PX, _MARGIN_PX = 320, 6.0


def main() -> None:
    """Print the table, and draw the pictures if they are asked for."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--pictures", type=Path, metavar="OUT")
    parser.add_argument("--sheet", type=Path, metavar="FILE")
    parser.add_argument("--page", type=Path, metavar="PAGE", help="put the figures into the table of this page")
    given = parser.parse_args()
    tiles, rows = {}, {}
    print(f"| {' | '.join(COLUMNS)} |")
    print(f"| --- |{' ---: |' * (len(COLUMNS) - 1)}")
    for name, points in original_curves(given.folder).items():
        mask = read_mask(given.folder / name)
        rows[Path(name).stem] = row = row_of(mask, points)
        print(f"| {' | '.join((Path(name).stem, *row))} |", flush=True)
        tiles[Path(name).stem] = curves_alone(mask)
        if given.pictures is not None:
            given.pictures.mkdir(parents=True, exist_ok=True)
            cv2.imwrite(str(given.pictures / name), beside_each_other(mask))
    if given.sheet is not None:
        cv2.imwrite(str(given.sheet), contact_sheet(list(tiles.values()), list(tiles), columns=6, tile_width=_TILE_PX))
    if given.page is not None:
        given.page.write_text(with_figures(given.page.read_text("utf-8"), rows), "utf-8")


def original_curves(folder: Path) -> dict[str, Points]:
    """Return the points of the authors' curves, by the file of the mask."""
    curves = json.loads((folder / "original_curves.json").read_text("utf-8"))
    return {name: np.array(points) for name, points in sorted(curves.items())}


def read_mask(file: Path) -> Mask:
    """Return the mask of a file, shape (H, W)."""
    return np.asarray(cv2.imread(str(file), cv2.IMREAD_GRAYSCALE), dtype=np.uint8)


def row_of(mask: Mask, theirs: Points) -> tuple[str, ...]:
    """Return the figures of a mask, as the columns say."""
    fine = refine(theirs)
    default, paper = (compare(mask, fine, config) for config in CONFIGS.values())
    sure = min(detection.confidence for detection in dloftbs.detect(mask))
    return (*default, f"{sure:.2f}", *paper)


def with_figures(page: str, rows: Mapping[str, Sequence[str]]) -> str:
    """Return a page with the figures of masks, by name, in the rows of its table; the words in the last column stay."""
    return _ROW.sub(lambda row: f"| {' | '.join((row['mask'], *rows[row['mask']], row['words']))} |", page)


def curves_alone(mask: Mask) -> Mask:
    """Draw what the default method finds in a mask (H, W), enlarged, without the mask."""
    result = dloftbs.Pipeline().detect(dloftbs.Frame(mask=mask))
    points = np.concatenate([detection.curve.sample(200) for detection in result.detections])
    low, high = points.min(axis=0) - _MARGIN_PX, points.max(axis=0) + _MARGIN_PX
    zoom = _TILE_PX / float((high - low).max())
    moved = [replace(d, curve=d.curve.transformed(np.eye(2) * zoom, -low * zoom)) for d in result.detections]
    blank = np.full((_TILE_PX, _TILE_PX, 3), 255, dtype=np.uint8)
    return draw(blank, replace(result, detections=tuple(moved), crossings=(), size=blank.shape[:2]))


def compare(mask: Mask, theirs: Points, config: dloftbs.Config) -> tuple[str, str, str]:
    """Return the mean distances from theirs to ours and back, and the largest, px."""
    curves = [detection.curve.sample(4000) for detection in dloftbs.detect(mask, config=config)]
    ours = np.concatenate(curves)
    there, back, most = mmd(theirs, ours), mmd(ours, theirs), farthest(ours, theirs)
    return f"{there:.2f}", f"{back:.2f}", f"{most:.1f}"


def beside_each_other(mask: Mask) -> Mask:
    """Draw a mask (H, W), cut to what is in it and enlarged, with the curves of either method."""
    (x, y), (right, bottom) = ((np.argwhere(mask)[:, ::-1]).min(axis=0), (np.argwhere(mask)[:, ::-1]).max(axis=0))
    cut = mask[y : bottom + 1, x : right + 1]
    zoom = max(_LONGER_SIDE_PX // max(cut.shape), 1)
    large = cv2.resize(cut, None, fx=zoom, fy=zoom, interpolation=cv2.INTER_NEAREST)
    offset = (0.5 - np.array([x, y])) * zoom - 0.5  # whole coordinates are the middles of pixels
    panels = []
    for config in CONFIGS.values():
        found = dloftbs.Pipeline(config).detect(dloftbs.Frame(mask=mask))
        moved = [replace(d, curve=d.curve.transformed(np.eye(2) * zoom, offset)) for d in found.detections]
        result = replace(found, detections=tuple(moved), size=large.shape)
        panels.append(draw(large, result))
    return contact_sheet(panels, list(CONFIGS), columns=2, tile_width=_LONGER_SIDE_PX // 2)


def refine(points: Points, factor: int = 16) -> Points:
    """Put more points on a polyline (n, 2), so that distances to it are not distances to its corners."""
    fine = np.linspace(0.0, len(points) - 1.0, factor * len(points))
    return np.stack([np.interp(fine, np.arange(len(points)), axis) for axis in points.T], axis=1)


def farthest(a: Points, b: Points) -> float:
    """Return the largest distance from a point of either set to the other set."""
    ours, theirs = a[::4], b
    there, _ = cKDTree(ours).query(theirs)
    back, _ = cKDTree(theirs).query(ours)
    return float(max(there.max(), back.max()))


if __name__ == "__main__":
    main()
