"""Strokes along cables, and strokes beside them."""

from __future__ import annotations

import cv2
import numpy as np
import pytest
from msgspec.structs import replace

from dloftbs.config import ColourConfig, Stroke
from dloftbs.segmentation import ColourModel, lies_along_band, pixels_of

SIZE = (160, 260)
WIDTH_PX = 12
X = np.linspace(15.0, 245.0, 60)
AXIS = np.column_stack((X, 80.0 + 20.0 * np.sin(X / 50.0)))


def picture(cable: int, ground: int, *, highlight: int | None = None, shadow: float = 0.0, grain: float = 0.0):
    """Return a shaded cable (H, W, 3) as a JPEG file keeps it, with light that changes across the picture."""
    rng = np.random.default_rng(0)
    rows, columns = np.mgrid[: SIZE[0], : SIZE[1]].astype(np.float32)
    axis = np.interp(columns[0], *AXIS.T)[None]
    off = np.abs(rows - axis) / (WIDTH_PX / 2)
    image = ground + grain * np.sin(rows / 2.3 + np.sin(columns / 40.0))
    image *= 1.0 - shadow * np.exp(-(((rows - axis - WIDTH_PX) / 6.0) ** 2))
    image = np.where(off < 1.0, cable * (0.7 + 0.3 * np.sqrt(np.clip(1.0 - off**2, 0.0, 1.0))), image)
    if highlight is not None:
        image = np.where(np.abs(rows - axis + 2.0) < 1.2, highlight, image)
    image = cv2.GaussianBlur(image * np.linspace(0.85, 1.0, SIZE[1]), (0, 0), 0.8) + rng.normal(0.0, 2.0, SIZE)
    grey = np.repeat(np.clip(image, 0, 255).astype(np.uint8)[..., None], 3, axis=2)
    return cv2.imdecode(cv2.imencode(".jpg", grey, [cv2.IMWRITE_JPEG_QUALITY, 90])[1], cv2.IMREAD_COLOR)


PICTURES = {
    "white on white": picture(235, 222),
    "white with a highlight and a shadow": picture(225, 212, highlight=255, shadow=0.15),
    "black on dark": picture(25, 50),
    "black with a highlight": picture(25, 50, highlight=130),
    "black on wood": picture(28, 80, grain=10.0, shadow=0.3),
}


def along(off_px: float) -> Stroke:
    return Stroke(points=[(x, y + off_px) for x, y in AXIS[5:55:5]])


@pytest.mark.parametrize("image", PICTURES.values(), ids=PICTURES)
class TestPlaces:
    @pytest.mark.parametrize("off_px", [0.0, 2.0, -2.0])
    def test_strokes_on_the_cable_lie_along_a_band(self, image: np.ndarray, off_px: float) -> None:
        assert lies_along_band(image, along(off_px))

    @pytest.mark.parametrize("off_px", [-12.0, -18.0, 34.0, 45.0])
    def test_strokes_beside_it_do_not(self, image: np.ndarray, off_px: float) -> None:
        assert not lies_along_band(image, along(off_px))

    def test_strokes_that_are_accepted_are_cable(self, image: np.ndarray) -> None:
        ground = [Stroke(points=[(x, y + off) for x, y in AXIS[::6]], cable=False) for off in (-28.0, 36.0)]
        pictures = ColourModel.pictures_of([(image, [along(0.0), *ground], "")])
        beneath = pixels_of(image.shape[:2], [along(0.0)])
        pictures = tuple([replace(picture, pixels="") for picture in pictures])  # so that colour decides either way
        accepted = ColourModel(ColourConfig(pictures=pictures, accept_strokes=True))(image)
        assert accepted[beneath].mean() > 0.6
        assert accepted[beneath].mean() >= ColourModel(ColourConfig(pictures=pictures))(image)[beneath].mean()


def test_a_click_and_a_short_stroke_lie_along_nothing() -> None:
    image = PICTURES["black on dark"]
    for points in ([(60.0, 99.0)], [(60.0, 99.0), (62.0, 99.0)]):
        assert not lies_along_band(image, Stroke(points=points))


def test_a_picture_of_one_colour_has_no_bands() -> None:
    assert not lies_along_band(np.full((*SIZE, 3), 90, np.uint8), along(0.0))
