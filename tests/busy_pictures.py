"""Pictures of a cable that colour does not tell."""

import cv2
import numpy as np

from dloftbs.segmentation import Stroke

SIZE = 200, 300
STROKES = [Stroke(points=[(40, 100), (120, 100)]), Stroke(points=[(150, 100), (240, 100)])]


def busy(seed=0, shift=0):
    """Return a picture of a grey cable of 11 px on grey blots of all sizes, and where it is."""
    rng = np.random.default_rng(seed)
    noise = sum(cv2.GaussianBlur(rng.normal(0, 1, SIZE), (0, 0), s) * s for s in (1.5, 4.0))
    ground = 110 + 45 * noise / noise.std()
    true = np.zeros(SIZE, np.uint8)
    cv2.polylines(true, [np.array([(10, 100), (290, 100)]) + shift], False, 1, 11)
    grey = np.where(true > 0, 150 + 25 * np.cos(np.arange(SIZE[1]) / 9.0), ground)
    image = np.clip(np.stack([grey * 1.02, grey, grey * 0.97], -1) + rng.normal(0, 2, (*SIZE, 3)), 0, 255)
    return image.round().astype(np.uint8), true > 0


def iou(mask, true):
    return np.sum(mask & true) / np.sum(mask | true)
