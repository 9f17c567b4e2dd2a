"""Curves in axes of matplotlib."""

from __future__ import annotations

from importlib import import_module
from typing import Any

import numpy as np

from dloftbs.data.frame_result import FrameResult
from dloftbs.data.spans import outside
from dloftbs.errors import InputError
from dloftbs.support.values import shown
from dloftbs.viz.items import Item, items_of
from dloftbs.viz.overlay import as_picture
from dloftbs.viz.style import Style, as_css

_STYLE = Style()
_SAMPLES = 200


def plot(result: FrameResult, ax: Any = None) -> Any:
    """Draw a result as `FrameResult.plot` says."""
    if ax is None:
        try:
            pyplot = import_module("matplotlib.pyplot")
        except ImportError as error:
            raise InputError("a plot needs matplotlib: pip install 'dloftbs[plot]'") from error
        _, ax = pyplot.subplots()
    elif not callable(getattr(ax, "imshow", None)):
        raise InputError(f"ax must be axes of matplotlib, got {shown(ax)}")
    height, width = result.size
    if result.frame is not None:
        ax.imshow(as_picture(result.frame, _STYLE)[..., ::-1])
    items = items_of(result, _STYLE)
    for item in items:
        _draw(ax, item)
    ax.set(xlim=(-0.5, width - 0.5), ylim=(height - 0.5, -0.5), aspect="equal", xlabel="x, px", ylabel="y, px")
    if items:
        ax.legend(loc="best")
    return ax


def _draw(ax: Any, item: Item) -> None:
    inferred = ((0.0, 1.0),) if item.hidden else item.inferred
    label: str | None = f"{item.label}, {item.curve.length:.0f} px"
    colour = as_css(item.colour)
    for style, spans in (("-", outside(list(inferred))), ("--", inferred)):
        for low, high in spans:
            points = item.curve(np.linspace(low, high, _SAMPLES))
            ax.plot(points[:, 0], points[:, 1], style, color=colour, label=label)
            label = None  # once in the legend
    if not item.curve.closed:
        (x, y), (x_end, y_end) = item.curve(np.array([0.0, 1.0]))
        ax.plot(x, y, "o", color=colour)
        ax.plot(x_end, y_end, "o", color=colour, fillstyle="none")
