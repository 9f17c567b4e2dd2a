import numpy as np
import pytest
from drawings import draw_cable, wave

import dloftbs
from dloftbs.ui.payload import describe

SIZE = (120, 200)


def test_a_curve_is_told_by_points_in_even_u():
    result = dloftbs.detect(draw_cable(wave(SIZE), 7, SIZE))
    (curve,) = describe(result)["curves"]
    points = np.reshape(curve["points"], (-1, 2))
    assert np.allclose(points, result[0].curve(np.linspace(0, 1, len(points))), atol=0.06)
    assert (curve["label"], curve["state"], curve["closed"], curve["space"]) == ("0", "detected", False, None)
    assert curve["confidence"] == pytest.approx(result[0].confidence)


def test_a_hidden_track_is_told_as_hidden():
    mask = draw_cable(wave(SIZE), 7, SIZE)
    pipeline = dloftbs.Pipeline()
    for index in range(5):
        pipeline.process(dloftbs.Frame(mask=mask, index=index))
    hidden = pipeline.process(dloftbs.Frame(mask=np.zeros_like(mask), occluders=np.ones_like(mask), index=5))
    (curve,) = describe(hidden)["curves"]
    assert (curve["hidden"], curve["state"], curve["label"]) == (True, "hidden", "#1 (1)")


def test_a_region_of_interest_is_told_by_its_corners():
    mask = draw_cable(wave(SIZE), 7, SIZE)
    told = [describe(dloftbs.detect(mask, roi=roi))["roi"] for roi in ((10, 5, 100, 90), [(0, 0), (199, 0), (9, 80)])]
    assert told == [[[10, 5], [109, 5], [109, 94], [10, 94]], [[0, 0], [199, 0], [9, 80]]]
    assert describe(dloftbs.detect(mask))["roi"] is None


def test_nothing_has_a_reason():
    told = describe(dloftbs.detect(np.zeros(SIZE, np.uint8)))
    assert (told["curves"], told["reason"], told["size"]) == ([], "the mask is empty", [200, 120])


def test_who_lies_below_is_told_by_u():
    image = np.full((*SIZE, 3), (90, 120, 90), np.uint8)
    image[57:64, 10:190] = (20, 20, 200)
    image[5:115, 96:103] = (200, 90, 20)
    mask = np.any(image != (90, 120, 90), axis=2)
    told = describe(dloftbs.detect(mask, image=image))["curves"]
    below = [u for curve in told for u in curve["below"]]
    assert below == [pytest.approx(0.5, abs=0.03)]
