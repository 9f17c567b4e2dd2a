"""The paper's figures, drawn with this package: strips of sequences, and curves in space over time.

Run it in the repository with ``python -m benchmarks.paper_strips FOLDER``, such as ``docs/images/paper``. All of it is
generated. It needs matplotlib.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import numpy.typing as npt

from dloftbs import Config, Pipeline
from dloftbs.data.frame_result import FrameResult
from dloftbs.viz import Style, draw
from dloftbs.viz.overlay import grey
from dloftbs.viz.shapes import Picture
from dloftbs_lab import KnownSequence
from dloftbs_lab.synthetic import RgbSequence, rgbd_artificial, rgbd_manipulation, several_cables

_SHOWN = 5
_TILE_PX = 400
_GAP_PX = 6
_FIRST = 8  # frames after which an object that begins behind a hand is known as one
_DPI = 130
_EARLY, _LATE = 0.12, 0.92  # of the colour map: its ends are too dark and too light on white
_CURVES = 14
_STYLE = Style(
    line_px=7.0, halo_px=2.5, dash_px=18.0, arrow_px=0.1, arrow_spacing_px=9999.0, marker_px=11.0, text_px=0.01
)

Points = npt.NDArray[np.float64]


def main(folder: Path) -> None:
    """Draw all figures into a folder."""
    folder.mkdir(parents=True, exist_ok=True)
    _save(folder / "strip-2d.jpg", strip_2d())
    _save(folder / "strip-several.png", strip_several())
    # In hands: the loop that is laid; artificial: the cable that is whipped.
    draw_space(rgbd_manipulation(seed=0, with_image=True)[0], folder / "strip-3d-hands.jpg", every=5)
    draw_space(rgbd_artificial(seed=0, with_image=True)[4], folder / "strip-3d-artificial.jpg", every=2, most=48)


def strip_2d() -> Picture:
    """Return some frames of a cable between two grippers, partly hidden, with its curve."""
    sequence = RgbSequence("several occlusions", 60)
    results = follow(sequence, range(len(sequence)))
    shown = np.linspace(_FIRST, len(sequence) - 1, _SHOWN).round().astype(int)
    return _row([draw(sequence.frame(int(i)), results[int(i)], style=_STYLE) for i in shown])


def strip_several() -> Picture:
    """Return masks of several cables as a network leaves them, and below their curves."""
    groups = several_cables(1.0, seed=0)
    pipeline = Pipeline(Config())
    above, below = [], []
    for group, index in zip(groups[1::2] + groups[-1:], (1, 2, 1, 3), strict=True):
        frame = group.frame(index)
        assert frame.mask is not None
        above.append(grey(frame.mask > 0, _STYLE))
        below.append(draw(frame, pipeline.detect(frame), style=_STYLE))
    return np.vstack([_row(above), np.full((_GAP_PX, _row(above).shape[1], 3), 255, np.uint8), _row(below)])


def draw_space(sequence: KnownSequence, path: Path, *, every: int = 1, most: int | None = None) -> None:
    """Draw some frames of a sequence with depth, and below all curves in space, from dark to light over time."""
    import matplotlib.pyplot as plt

    indices = range(0, len(sequence) if most is None else most, every)
    results = follow(sequence, indices)
    shown = [indices[i] for i in np.linspace(0, len(indices) - 1, _SHOWN).round().astype(int)]
    tiles = [_tile(draw(sequence.frame(i), results[i], style=_STYLE)) for i in shown]
    curves = {i: _in_space(results[i]) for i in indices}
    figure = plt.figure(figsize=(12.0, 6.4), dpi=_DPI, facecolor="white")
    colours = plt.get_cmap("viridis")(np.linspace(_EARLY, _LATE, len(indices)))
    of_time = dict(zip(indices, colours, strict=True))
    for place, (index, tile) in enumerate(zip(shown, tiles, strict=True)):
        axes: Any = figure.add_axes((0.01 + 0.197 * place, 0.76, 0.192, 0.21))
        axes.imshow(tile[:, :, ::-1])
        axes.set(xticks=[], yticks=[])
        for side in axes.spines.values():
            side.set(color=of_time[index], linewidth=3.0)
    _plot_curves(figure, curves, of_time)
    figure.savefig(path, pil_kwargs={"quality": 88})
    plt.close(figure)


def _plot_curves(figure: Any, curves: dict[int, Points | None], of_time: dict[int, Any]) -> None:
    """Plot curves in space as the camera sees them: x to the right, y down, z away."""
    import matplotlib as mpl
    from matplotlib.ticker import MaxNLocator

    axes = figure.add_axes((0.05, -0.02, 0.84, 0.78), projection="3d", zorder=-1, facecolor="none")
    known = {index: curve for index, curve in curves.items() if curve is not None}
    step = max(1, len(known) // _CURVES)
    for index in list(known)[::step]:
        x, y, z = known[index].T
        axes.plot(x, z, -y, color=of_time[index], linewidth=2.4, solid_capstyle="round", clip_on=False)
    points = np.concatenate(list(known.values()))
    low, high = points.min(axis=0), points.max(axis=0)
    axes.set_box_aspect((high - low)[[0, 2, 1]].clip(min=0.25 * (high - low).max()), zoom=_zoom(high - low))
    axes.set(xlabel="x, m", ylabel="z, m", zlabel="-y, m")
    for axis, number in ((axes.xaxis, 6), (axes.yaxis, 3), (axes.zaxis, 4)):
        axis.set_major_locator(MaxNLocator(number))
    axes.view_init(elev=24.0, azim=-68.0)
    axes.tick_params(labelsize=7)
    for axis in (axes.xaxis, axes.yaxis, axes.zaxis):
        axis.pane.set(facecolor="#f6f7f9", edgecolor="#d5d9e0")
    of_map = mpl.cm.ScalarMappable(mpl.colors.Normalize(0, 1), mpl.colors.ListedColormap(list(of_time.values())))
    bar = figure.colorbar(of_map, ax=axes, cax=figure.add_axes((0.93, 0.14, 0.012, 0.5)), ticks=[0, 1])
    bar.ax.set_yticklabels(["first frame", "last"], fontsize=8)
    bar.outline.set_visible(False)


def follow(sequence: KnownSequence, indices: Sequence[int]) -> dict[int, FrameResult]:
    """Return what the default method finds in frames of a sequence, one after the other."""
    pipeline = Pipeline(Config())
    return {index: pipeline.process(sequence.frame(index)) for index in indices}


def _in_space(result: FrameResult) -> Points | None:
    """Return the longest curve in space, (n, 3) m, or None where there is none."""
    known = [track.curve_3d for track in result.tracks if track.curve_3d is not None]
    return max(known, key=lambda curve: curve.length).sample(200) if known else None


def _zoom(extent_m: Points) -> float:
    """Return how much a flat box is enlarged: a high one fills the axes already."""
    return 1.45 if extent_m[1] < 0.5 * extent_m[0] else 0.92


def _row(pictures: Sequence[Picture]) -> Picture:
    tiles = [_tile(picture) for picture in pictures]
    gap = np.full((tiles[0].shape[0], _GAP_PX, 3), 255, np.uint8)
    return np.hstack([part for tile in tiles for part in (gap, tile)][1:])


def _tile(picture: Picture) -> Picture:
    height = round(_TILE_PX * picture.shape[0] / picture.shape[1])
    return np.asarray(cv2.resize(picture, (_TILE_PX, height), interpolation=cv2.INTER_AREA), np.uint8)


def _save(path: Path, picture: Picture) -> None:
    options = [cv2.IMWRITE_PNG_COMPRESSION, 9] if path.suffix == ".png" else [cv2.IMWRITE_JPEG_QUALITY, 88]
    cv2.imwrite(str(path), picture, options)


if __name__ == "__main__":
    main(Path(sys.argv[1]))
