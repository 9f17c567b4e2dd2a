"""How near the published method, as it is here, comes to the curves of the authors' own implementation.

Run it with ``python -m benchmarks.original_curves FOLDER``, where the folder holds masks and ``original_curves.json``:
points (x, y) of the authors' curve by the name of the mask. Prints a table in Markdown.
"""

from __future__ import annotations

import argparse
import json
from pathlib import Path

import cv2
import numpy as np
import numpy.typing as npt

import dloftbs
from dloftbs.evaluation import mmd

Points = npt.NDArray[np.float64]


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path)
    folder = parser.parse_args().folder
    print("| mask | curves | theirs to ours, px | ours to theirs, px | farthest, px |")
    print("| --- | --- | --- | --- | --- |")
    for name, points in sorted(json.loads((folder / "original_curves.json").read_text()).items()):
        mask = np.asarray(cv2.imread(str(folder / name), cv2.IMREAD_GRAYSCALE))
        curves = [detection.curve.sample(4000) for detection in dloftbs.detect(mask, dloftbs.Config.paper())]
        ours, theirs = np.concatenate(curves), refine(np.array(points))
        there, back = mmd(theirs, ours), mmd(ours, theirs)
        print(f"| {name} | {len(curves)} | {there:.2f} | {back:.2f} | {farthest(ours, theirs):.1f} |")


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
