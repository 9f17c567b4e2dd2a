"""A small network on pixels, trained on labelled photographs: soft masks of a kind that nobody here has fitted to."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import NamedTuple

import cv2
import numpy as np
import numpy.typing as npt

_HIDDEN = (24, 12)
_EPOCHS, _BATCH, _RATE = 12, 512, 3e-3
_OF_CABLE, _OF_GROUND = 1500, 3000  # pixels of each photograph
_PRIOR = 2.0  # nats by which cable is rarer in a photograph than in what is learned
_BLUR_PX = 1.5  # of what the network gives, as the upsampling of a larger one does

Floats = npt.NDArray[np.float32]
Image = npt.NDArray[np.uint8]


class PixelNetwork(NamedTuple):
    """Weights of a network of three layers, and the mean and the deviation of its inputs."""

    layers: tuple[tuple[Floats, Floats], ...]
    mean: Floats
    deviation: Floats

    def __call__(self, image: Image) -> Image:
        """Return the probability of each pixel, of 8 bits."""
        described = describe(image)
        values = ((described.reshape(-1, described.shape[-1]) - self.mean) / self.deviation).astype(np.float32)
        scores = _forward(self.layers, values)[-1].reshape(image.shape[:2]) - _PRIOR
        grey = (255.0 / (1.0 + np.exp(-scores))).astype(np.uint8)
        return np.asarray(cv2.GaussianBlur(grey, None, _BLUR_PX), np.uint8)


def describe(image: Image) -> Floats:
    """Return the colour of each pixel, smoothed and as a contrast, and ridges and edges at three scales (H, W, k)."""
    lab = cv2.cvtColor(image, cv2.COLOR_BGR2LAB).astype(np.float32) / 255.0
    channels = []
    for sigma in (1.0, 3.0, 8.0, 20.0):
        smooth = cv2.GaussianBlur(lab, None, sigma)
        channels.append(smooth)
        if sigma > 1.0:
            channels.append(lab - smooth)
    for sigma in (2.0, 4.0, 8.0):
        grey = cv2.GaussianBlur(lab[..., 0], None, sigma)
        xx, yy, xy, x, y = (cv2.Sobel(grey, cv2.CV_32F, *order) for order in ((2, 0), (0, 2), (1, 1), (1, 0), (0, 1)))
        apart = np.sqrt((xx - yy) ** 2 + 4.0 * xy**2)
        ridges = 0.5 * sigma**2 * (xx + yy + apart), 0.5 * sigma**2 * (xx + yy - apart)
        channels.append(np.stack((*ridges, sigma * np.hypot(x, y)), axis=-1))
    return np.concatenate(channels, axis=-1)


def train(images: Sequence[Image], labels: Sequence[Image], seed: int) -> PixelNetwork:
    """Train a network on photographs, and on images that are not 0 where there is cable, by Adam."""
    rng = np.random.default_rng(seed)
    inputs, is_cable = [], []
    for image, label in zip(images, labels, strict=True):
        described = describe(image)
        picked = np.concatenate(
            [
                rng.choice(np.flatnonzero((label.ravel() > 0) == kind), count)
                for kind, count in ((True, _OF_CABLE), (False, _OF_GROUND))
            ]
        )
        inputs.append(described.reshape(-1, described.shape[-1])[picked])
        is_cable.append(label.ravel()[picked] > 0)
    given, wanted = np.concatenate(inputs), np.concatenate(is_cable).astype(np.float32)[:, None]
    mean, deviation = given.mean(axis=0), given.std(axis=0) + np.float32(1e-6)
    given = (given - mean) / deviation
    sizes = (given.shape[1], *_HIDDEN, 1)
    weights: list[Floats] = []
    for before, after in pairwise(sizes):
        weights.append(rng.normal(0.0, before**-0.5, (before, after)).astype(np.float32))
        weights.append(np.zeros(after, np.float32))
    first, second = [np.zeros_like(one) for one in weights], [np.zeros_like(one) for one in weights]
    step = 0
    for _ in range(_EPOCHS):
        for batch in np.array_split(rng.permutation(len(given)), len(given) // _BATCH):
            step += 1
            for k, slope in enumerate(_slopes(_pairs(weights), given[batch], wanted[batch])):
                first[k] = 0.9 * first[k] + 0.1 * slope
                second[k] = 0.999 * second[k] + 0.001 * slope**2
                move = first[k] / (1.0 - 0.9**step) / (np.sqrt(second[k] / (1.0 - 0.999**step)) + 1e-8)
                weights[k] = (weights[k] - _RATE * move).astype(np.float32)
    return PixelNetwork(_pairs(weights), mean, deviation)


def _pairs(weights: Sequence[Floats]) -> tuple[tuple[Floats, Floats], ...]:
    return tuple(zip(weights[::2], weights[1::2], strict=True))


def _forward(layers: Sequence[tuple[Floats, Floats]], values: Floats) -> list[Floats]:
    """Return what each layer gives, the input first."""
    found = [values]
    for k, (weights, bias) in enumerate(layers):
        sums = found[-1] @ weights + bias
        found.append(sums if k == len(layers) - 1 else np.tanh(sums))
    return found


def _slopes(layers: Sequence[tuple[Floats, Floats]], values: Floats, wanted: Floats) -> list[Floats]:
    """Return the derivatives of the mean cross entropy by all weights, in their order."""
    found = _forward(layers, values)
    slope = (1.0 / (1.0 + np.exp(-found[-1])) - wanted) / np.float32(len(values))
    slopes: list[Floats] = []
    for k in reversed(range(len(layers))):
        slopes = [found[k].T @ slope, slope.sum(axis=0), *slopes]
        slope = (slope @ layers[k][0].T) * (1.0 - found[k] ** 2)
    return slopes
