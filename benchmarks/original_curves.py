"""How near both methods come to the curves of the authors' own implementation, and pictures of what they find.

Run it with ``python -m benchmarks.original_curves FOLDER``, where the folder holds masks and ``original_curves.json``:
points (x, y) of the authors' curve by the name of the mask. Prints a table in Markdown. With ``--pictures OUT`` it also
draws each mask with the default method's curves beside the published method's, a PNG a mask; with ``--sheet FILE`` the
default method's curves of all masks, without the masks.
"""

from __future__ import annotations

import argparse
import json
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import numpy.typing as npt

import dloftbs
from dloftbs.evaluation import mmd
from dloftbs.viz import contact_sheet, draw

Points = npt.NDArray[np.float64]
Mask = npt.NDArray[np.uint8]

CONFIGS = {"default": dloftbs.Config(), "paper": dloftbs.Config.paper(objects=1)}
_LONGER_SIDE_PX = 1280
_TILE_PX, _MARGIN_PX = 320, 6.0


def main() -> None:
    """Print the table, and draw the pictures if they are asked for."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--pictures", type=Path, metavar="OUT")
    parser.add_argument("--sheet", type=Path, metavar="FILE")
    given = parser.parse_args()
    tiles = {}
    columns = [f"{name}: {what}" for name in CONFIGS for what in ("curves", "to ours, px", "back, px", "farthest, px")]
    print(f"| mask | {' | '.join(columns)} | default: confidence |")
    print(f"| --- |{' ---: |' * (len(columns) + 1)}")
    for name, points in sorted(json.loads((given.folder / "original_curves.json").read_text()).items()):
        mask = np.asarray(cv2.imread(str(given.folder / name), cv2.IMREAD_GRAYSCALE), dtype=np.uint8)
        cells = [cell for config in CONFIGS.values() for cell in compare(mask, refine(np.array(points)), config)]
        sure = min(detection.confidence for detection in dloftbs.detect(mask))
        print(f"| {name} | {' | '.join(cells)} | {sure:.2f} |")
        tiles[Path(name).stem] = curves_alone(mask)
        if given.pictures is not None:
            given.pictures.mkdir(parents=True, exist_ok=True)
            cv2.imwrite(str(given.pictures / name), beside_each_other(mask))
    if given.sheet is not None:
        cv2.imwrite(str(given.sheet), contact_sheet(list(tiles.values()), list(tiles), columns=6, tile_width=_TILE_PX))


def curves_alone(mask: Mask) -> Mask:
    """Draw what the default method finds in a mask (H, W), enlarged, without the mask."""
    result = dloftbs.Pipeline().detect(dloftbs.Frame(mask=mask))
    points = np.concatenate([detection.curve.sample(200) for detection in result.detections])
    low, high = points.min(axis=0) - _MARGIN_PX, points.max(axis=0) + _MARGIN_PX
    zoom = _TILE_PX / float((high - low).max())
    moved = [replace(d, curve=d.curve.transformed(np.eye(2) * zoom, -low * zoom)) for d in result.detections]
    blank = np.full((_TILE_PX, _TILE_PX, 3), 255, dtype=np.uint8)
    return draw(blank, replace(result, detections=tuple(moved), crossings=(), size=blank.shape[:2]))


def compare(mask: Mask, theirs: Points, config: dloftbs.Config) -> tuple[str, str, str, str]:
    """Return how many curves there are, the mean distances from theirs to ours and back, and the largest, px."""
    curves = [detection.curve.sample(4000) for detection in dloftbs.detect(mask, config=config)]
    ours = np.concatenate(curves)
    there, back, most = mmd(theirs, ours), mmd(ours, theirs), farthest(ours, theirs)
    return str(len(curves)), f"{there:.2f}", f"{back:.2f}", f"{most:.1f}"


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
    apart = np.linalg.norm(a[::4, None] - b[None], axis=2)
    return float(max(apart.min(axis=1).max(), apart.min(axis=0).max()))


if __name__ == "__main__":
    main()
