"""Routes of harnesses on photographs: instance DICE and right numbers, by hand-made masks and by a network's.

``python -m benchmarks.harnesses DIR`` reads ``NAME.hand.png``, ``NAME.r101.png`` and ``NAME.route_K.png`` of a folder
as `BWH <https://github.com/ForNe-tech/CVF-DLO>`_ has them; ``--overlays OUT`` draws what was found, too.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import cv2
import numpy as np
import numpy.typing as npt
from scipy.optimize import linear_sum_assignment

import dloftbs
from dloftbs import BSplineCurve, Config, FrameResult

_Picture = npt.NDArray[np.uint8]
Masks = list[npt.NDArray[np.bool_]]


def read(path: Path, flags: int) -> _Picture:
    """Return a picture."""
    return np.asarray(cv2.imread(str(path), flags), np.uint8)


def drawn(curve: BSplineCurve, width: float, size: tuple[int, int]) -> npt.NDArray[np.bool_]:
    """Return a curve drawn with a width, shape (H, W)."""
    points = curve(np.linspace(0.0, 1.0, max(int(curve.length / 2.0), 2)))
    canvas = np.zeros(size, np.uint8)
    line = np.rint(points * 16.0).astype(np.int32)
    cv2.polylines(canvas, [line], curve.closed, (255.0,), max(round(width), 1), cv2.LINE_8, 4)
    return canvas > 0


def instance_dice(found: Masks, true: Masks) -> float:
    """Return the mean DICE of matched masks, over the larger of both numbers."""
    if not found or not true:
        return float(len(found) == len(true))
    table = np.array([[2.0 * (a & b).sum() / max(a.sum() + b.sum(), 1) for b in true] for a in found])
    rows, columns = linear_sum_assignment(-table)
    return float(table[rows, columns].sum() / max(len(found), len(true)))


def objects_of(result: FrameResult) -> list[tuple[BSplineCurve, float]]:
    """Return the routes of a result, or its detections where objects do not branch."""
    if result.harnesses:
        return [(route.curve, route.width) for route in result.routes]
    return [(one.curve, one.width_px) for one in result]


def overlay(image: npt.NDArray[np.uint8], result: FrameResult) -> npt.NDArray[np.uint8]:
    """Return a picture with branches, branch points and routes."""
    canvas: npt.NDArray[np.uint8] = (image // 2).astype(np.uint8)
    palette = [
        (255, 80, 80),
        (80, 255, 80),
        (80, 80, 255),
        (0, 255, 255),
        (255, 0, 255),
        (255, 255, 0),
        (200, 200, 200),
    ]
    for k, one in enumerate(result):
        line = np.rint(one.curve(np.linspace(0.0, 1.0, 200))).astype(np.int32)
        cv2.polylines(canvas, [line], one.curve.closed, palette[k % len(palette)], 3)
    for point in result.branch_points:
        x, y = (round(value) for value in point.position)
        cv2.circle(canvas, (x, y), 7, (255, 255, 255), 2)
    return canvas


def main() -> None:
    """Score both kinds of masks of a folder."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--overlays", type=Path)
    parser.add_argument("--unbranched", action="store_true", help="read them as cables, as without the switch")
    options = parser.parse_args()
    config = Config().replace({"linking.branched": not options.unbranched})
    for kind in ("hand", "r101"):
        dices, right = [], []
        for path in sorted(options.folder.glob(f"*.{kind}.png")):
            name = path.name.split(".")[0]
            mask = read(path, cv2.IMREAD_GRAYSCALE)
            routes = [read(one, cv2.IMREAD_GRAYSCALE) > 0 for one in sorted(options.folder.glob(f"{name}.route_*.png"))]
            result = dloftbs.detect(mask, config=config)
            found = [drawn(curve, width, result.size) for curve, width in objects_of(result)]
            dices.append(instance_dice(found, routes))
            right.append(len(found) == len(routes))
            print(f"{kind:5} {name:8} dice {dices[-1]:.3f}  {len(found)} of {len(routes)}", flush=True)
            if options.overlays is not None:
                image = read(options.folder / f"{name}.jpg", cv2.IMREAD_COLOR)
                options.overlays.mkdir(parents=True, exist_ok=True)
                cv2.imwrite(str(options.overlays / f"{name}.{kind}.png"), overlay(image, result))
        print(f"{kind}: instance DICE {np.mean(dices):.3f}, right number {np.mean(right):.3f}")


if __name__ == "__main__":
    main()
