"""Many pictures on one sheet."""

from __future__ import annotations

from collections.abc import Sequence

import cv2
import numpy as np
import numpy.typing as npt

from dloftbs.errors import InputError
from dloftbs.support.values import MAX_PX, MAX_WHOLE, check_integer, shown
from dloftbs.viz.lettering import Text
from dloftbs.viz.overlay import as_picture
from dloftbs.viz.shapes import Picture
from dloftbs.viz.style import Style

_MIN_TILE_PX = 16


def contact_sheet(
    pictures: Sequence[npt.ArrayLike], titles: Sequence[str] | None = None, *, columns: int = 4, tile_width: int = 480
) -> Picture:
    """Put pictures side by side and below each other.

    Parameters
    ----------
    pictures : sequence of array_like, shape (H, W, 3), uint8, or shape (H, W), bool or any integer type
        BGR images, or masks, of any sizes. Each is fitted, its aspect kept, into a square of `tile_width`.
    titles : sequence of str, optional
        One for each picture, written above it.
    columns : int
        Tiles in a row; fewer where there are fewer pictures.
    tile_width : int
        Width of a tile, px; at least 16.

    Returns
    -------
    numpy.ndarray, shape (H, W, 3), uint8
        BGR.

    Raises
    ------
    InputError
        If there is no picture, one has a wrong shape or type, the titles are not as many as the pictures, or a number
        is out of range.
    """
    if not isinstance(pictures, (Sequence, np.ndarray)) or len(pictures) == 0:
        raise InputError(f"a contact sheet needs a sequence of at least one picture, got {shown(pictures)}")
    if titles is not None and not (isinstance(titles, Sequence) and all(isinstance(title, str) for title in titles)):
        raise InputError(f"titles must be texts, one for each picture, got {shown(titles)}")
    columns = check_integer("columns", columns, 1, MAX_WHOLE)
    tile_width = check_integer("tile_width", tile_width, _MIN_TILE_PX, MAX_PX)
    style = Style()
    tiles = [fitted(as_picture(picture, style), tile_width) for picture in pictures]
    return arrange(tiles, titles, columns, tile_width, style)


def fitted(picture: Picture, side: int) -> Picture:
    """Return a picture resized as a whole, so that its longer side has a length, px."""
    height, width = picture.shape[:2]
    scale = side / max(height, width)
    size = (max(1, round(width * scale)), max(1, round(height * scale)))
    how = cv2.INTER_AREA if scale < 1.0 else cv2.INTER_LINEAR
    return cv2.resize(picture, size, interpolation=how).astype(np.uint8, copy=False)


def arrange(
    tiles: Sequence[Picture], titles: Sequence[str] | None, columns: int, tile_width: int, style: Style
) -> Picture:
    """Return a sheet with the tiles, none wider than `tile_width`, in rows as high as their highest tile.

    Raises
    ------
    InputError
        If the titles are not as many as the tiles.
    """
    if titles is not None and len(titles) != len(tiles):
        raise InputError(f"titles must be as many as pictures, {len(tiles)}, got {len(titles)}")
    capital = min(max(tile_width / 40.0, 7.0), 18.0)
    gutter = max(4, tile_width // 60)
    bar = 0 if titles is None else Text("", capital).size[1]
    columns = min(columns, len(tiles))
    rows = [range(first, min(first + columns, len(tiles))) for first in range(0, len(tiles), columns)]
    heights = [bar + max(tiles[i].shape[0] for i in row) for row in rows]
    shape = (sum(heights) + gutter * (len(rows) + 1), columns * (tile_width + gutter) + gutter, 3)
    sheet: Picture = np.full(shape, style.background, np.uint8)
    top = gutter
    for row, height in zip(rows, heights, strict=True):
        for column, i in enumerate(row):
            tall, wide = tiles[i].shape[:2]
            left = gutter + column * (tile_width + gutter) + (tile_width - wide) // 2
            if titles is not None:
                Text(titles[i], capital).shortened(tile_width).write(sheet, left, top, style.paper)
            sheet[top + bar : top + bar + tall, left : left + wide] = tiles[i]
        top += height + gutter
    return sheet
