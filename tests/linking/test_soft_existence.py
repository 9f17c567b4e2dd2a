"""Objects of soft masks: sure, long and steady ones are real, others less probably."""

import cv2
import numpy as np

from dloftbs.data.centerline import Centerline, Segment
from dloftbs.linking import with_soft_existence
from dloftbs.support.values import varied

SIZE = (240, 320)


def line(length=200, radius=4.0, wobble=0.0):
    points = np.stack([np.arange(length) + 20.0, np.full(length, 100.0)], axis=1)
    return Centerline((Segment(points, radius + wobble * np.sin(np.arange(length))),), (), False)


def soft(value=255):
    mask = np.zeros(SIZE, np.uint8)
    cv2.line(mask, (15, 100), (300, 100), value, 9)
    return cv2.GaussianBlur(mask, None, 1.0)


def existence(given, mask):
    return with_soft_existence([given], mask)[0].existence


def test_what_the_mask_is_sure_of_is_real_and_what_it_doubts_less_so():
    assert existence(line(), soft()) > 0.9
    assert existence(line(), soft(60)) < existence(line(), soft(140)) < existence(line(), soft())


def test_an_unsteady_width_and_a_short_length_speak_against_it():
    sure = existence(line(), soft(140))
    assert existence(line(wobble=2.0), soft(140)) < sure
    assert existence(line(length=20), soft(140)) < sure


def test_doubt_about_its_size_stays():
    doubtful = varied(line(), existence=0.5)
    assert existence(doubtful, soft()) == 0.5 * existence(line(), soft())
