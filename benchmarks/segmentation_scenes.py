"""Pictures of cables whose pixels are known: photographs, cables of photographs pasted elsewhere, drawn scenes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
import numpy.typing as npt
from skimage import data

from dloftbs_lab.synthetic.layers import Layer, cast_shadow, stack_layers, visible_cables
from dloftbs_lab.synthetic.sketch import LIGHT, halfway, smooth_noise
from dloftbs_lab.synthetic.strand import Strand, random_strand
from dloftbs_lab.synthetic.workbench import draw_wood

Image = npt.NDArray[np.uint8]
Rng = np.random.Generator

BUSY = ("astronaut", "chelsea", "coffee", "rocket", "brick", "gravel", "grass", "motorcycle")
"""Photographs that are installed with scikit-image."""
SIZE = 480, 640
_HALFWAY = halfway(LIGHT)


@dataclass(frozen=True, eq=False)
class Picture:
    """An image (H, W, 3) BGR, and the number of the cable at each pixel, 0 where there is none, shape (H, W)."""

    image: Image
    labels: Image

    @property
    def numbers(self) -> list[int]:
        """Numbers of the cables."""
        return [int(number) for number in np.unique(self.labels) if number]


def matching(folder: Path, pattern: str) -> list[Path]:
    """Return the files or folders of a pattern, sorted; the command ends with an error where there are none."""
    paths = sorted(folder.glob(pattern))
    if not paths:
        raise SystemExit(f"{folder.resolve()} has no {pattern}: data are missing, or the folder is another")
    return paths


def photographs(folder: Path) -> list[Picture]:
    """Read a folder of ``NN.jpg`` and ``NN.labels.png``."""
    return [_read(path) for path in matching(folder, "*.jpg")]


def _read(path: Path) -> Picture:
    labels = cv2.imread(str(path.with_suffix(".labels.png")), cv2.IMREAD_GRAYSCALE)
    return Picture(np.asarray(cv2.imread(str(path)), np.uint8), np.asarray(labels, np.uint8))


def busy_ground(name: str, size: tuple[int, int], rng: Rng) -> Image:
    """Cut a part out of a photograph, enlarged and mirrored at random, shape (H, W, 3) BGR."""
    whole = data.stereo_motorcycle()[0] if name == "motorcycle" else getattr(data, name)()
    whole = cv2.cvtColor(whole, cv2.COLOR_GRAY2BGR if whole.ndim == 2 else cv2.COLOR_RGB2BGR)
    scale = rng.uniform(1.05, 1.4) * max(size[0] / whole.shape[0], size[1] / whole.shape[1])
    large = cv2.resize(whole, None, fx=scale, fy=scale, interpolation=cv2.INTER_CUBIC)
    top, left = (int(rng.integers(0, have - need + 1)) for have, need in zip(large.shape, size, strict=False))
    part = large[top : top + size[0], left : left + size[1]]
    return np.ascontiguousarray(part[:, ::-1] if rng.random() < 0.5 else part)


def pasted(picture: Picture, ground: Image) -> Picture:
    """Lay the cables of a picture on another ground, softly at their borders."""
    alpha = cv2.GaussianBlur((picture.labels > 0).astype(np.float32), (0, 0), 0.6)[..., None]
    mixed = alpha * picture.image + (1.0 - alpha) * ground
    return Picture(mixed.round().astype(np.uint8), picture.labels)


def drawn(
    ground: Image, dyes: Sequence[npt.NDArray[np.float64]], width_px: float, rng: Rng, change: float = 1.0
) -> Picture:
    """Draw a cable of each dye on a ground: round, glossy, with shadows; exposure and tint of the light vary."""
    canvas = ground.copy()
    size = canvas.shape[0], canvas.shape[1]
    length = rng.uniform(500.0, 900.0, len(dyes))
    strands = [random_strand(rng, float(px), size, 5.0 * width_px, 2.0 * width_px) for px in length]
    cast_shadow(canvas, strands, width_px)
    layers = stack_layers(strands, width_px, size)
    _paint(canvas, layers, strands, dyes, width_px)
    labels = (visible_cables(layers, width_px, size) + 1).astype(np.uint8)
    return Picture(exposed(canvas, rng, change), labels)


def _paint(
    canvas: Image,
    layers: Sequence[Layer],
    strands: Sequence[Strand],
    dyes: Sequence[npt.NDArray[np.float64]],
    width_px: float,
) -> None:
    """Paint smooth, glossy cables under a lamp in a bright room: half of the light comes from everywhere."""
    flat = canvas.reshape(-1, 3)
    dye = np.stack(dyes)
    tangents = [strand.tangents for strand in strands]
    for layer in layers:
        tangent = np.stack([tangents[c][s] for c, s in zip(layer.cable, layer.sample, strict=True)])
        q = np.clip(2.0 * layer.offset / width_px, -1.0, 1.0)
        up, side = np.sqrt(1.0 - q * q), np.stack((-tangent[:, 1], tangent[:, 0]), axis=1)
        diffuse = np.maximum(q * (side @ LIGHT[:2]) + up * LIGHT[2], 0.0)
        shine = np.maximum(q * (side @ _HALFWAY[:2]) + up * _HALFWAY[2], 0.0) ** 30
        surface = dye[layer.cable] * (0.55 + 0.2 * up + 0.35 * diffuse)[:, None] + 45.0 * shine[:, None]
        alpha = np.clip(width_px / 2.0 - np.abs(layer.offset) + 0.5, 0.0, 1.0)[:, None]
        beside = np.clip((np.abs(layer.offset) / width_px - 0.5) / 0.55, 0.0, 1.0)
        below = flat[layer.pixel] * (1.0 - 0.25 * (1.0 - beside) ** 2)[:, None]
        flat[layer.pixel] = np.clip(below + alpha * (surface - below), 0.0, 255.0).round().astype(np.uint8)


def exposed(canvas: Image, rng: Rng, change: float = 1.0) -> Image:
    """Take a picture: light of another strength (15 % times `change`) and tint, uneven, blur, noise, JPEG."""
    size = canvas.shape[0], canvas.shape[1]
    gain = np.exp(change * rng.normal(0.0, 0.15)) * np.exp(change * rng.normal(0.0, 0.03, 3))
    y, x = np.linspace(-1.0, 1.0, size[0])[:, None], np.linspace(-1.0, 1.0, size[1])
    slope = change * rng.normal(0.0, 0.08, 2)
    light = (1.0 + slope[0] * x + slope[1] * y)[..., None] * gain
    image = cv2.GaussianBlur(canvas.astype(np.float64) * light, (0, 0), 0.6)
    image = np.clip(image + rng.normal(0.0, 2.5, image.shape), 0.0, 255.0).round().astype(np.uint8)
    _, packed = cv2.imencode(".jpg", image, [cv2.IMWRITE_JPEG_QUALITY, 90])
    return np.asarray(cv2.imdecode(packed, cv2.IMREAD_COLOR), np.uint8)


def wood(rng: Rng, size: tuple[int, int] = SIZE) -> Image:
    """Draw planks, shape (H, W, 3)."""
    return np.clip(draw_wood(rng, size, 0.7), 0.0, 255.0).round().astype(np.uint8)


def steel(rng: Rng, size: tuple[int, int] = SIZE) -> Image:
    """Draw brushed steel under a lamp, with scratches, shape (H, W, 3)."""
    brushed = 5.0 * smooth_noise(rng, size, (1.2, 90.0)) + 3.0 * smooth_noise(rng, size, (3.0, 240.0))
    sheen = 22.0 * smooth_noise(rng, size, (size[0] * 1.2, 160.0))
    grey = 138.0 + brushed + sheen
    steel = grey[..., None] * np.array([1.03, 1.0, 0.98])
    canvas = np.clip(steel, 0.0, 255.0).round().astype(np.uint8)
    for _ in range(25):
        start = rng.uniform(0.0, 1.0, 2) * (size[1], size[0])
        end = start + rng.normal(0.0, 40.0, 2)
        level = int(rng.choice((105, 175)))
        line = [tuple(int(v) for v in point) for point in (start, end)]
        cv2.line(canvas, line[0], line[1], (level, level, level), 1, cv2.LINE_AA)
    return canvas
