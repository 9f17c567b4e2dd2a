from __future__ import annotations

import base64
import re
from xml.etree import ElementTree

import cv2
import numpy as np
import pytest
from drawings import draw_cable, wave

import dloftbs
from dloftbs import viz
from dloftbs.errors import InputError

SIZE = (120, 200)
MASK = draw_cable(wave(SIZE), 7, SIZE)
NAMES = {"s": "http://www.w3.org/2000/svg"}


def parsed(picture):
    return ElementTree.fromstring(picture.svg)


def test_it_stands_alone_with_its_picture():
    image = np.full((*SIZE, 3), (10, 200, 30), np.uint8)
    root = parsed(viz.show(dloftbs.detect(MASK, image=image)))
    assert root.get("viewBox") == "0 0 200 120"
    kind, _, data = root.find("s:image", NAMES).get("href").partition(",")
    assert kind == "data:image/jpeg;base64"
    pixels = cv2.imdecode(np.frombuffer(base64.b64decode(data), np.uint8), cv2.IMREAD_COLOR)
    assert np.abs(pixels.astype(int) - image).max() < 6


def test_each_curve_tells_what_it_is_and_lies_where_it_was_found():
    result = dloftbs.detect(MASK)
    picture = viz.show(result)
    (group,) = parsed(picture).findall("s:g/s:g", NAMES)
    title = group.find("s:title", NAMES).text
    assert title == f"0, {result[0].curve.length:.0f} px long, {result[0].width_px:.1f} px wide, confidence 1.00"
    lines = [line.get("points") for line in group.findall("s:polyline", NAMES)]
    points = np.array([[float(x) for x in point.split(",")] for line in lines for point in line.split()]) - 0.5
    assert np.abs(points[:, None] - result[0].curve.sample(2000)).sum(axis=2).min(axis=1).max() < 0.5
    assert picture._repr_html_().count("<svg") == 1
    assert re.fullmatch(r"VectorPicture\(\d+ characters of SVG\)", repr(picture))


def test_tracks_and_frames_given_beside_them():
    pipeline = dloftbs.Pipeline()
    for _ in range(3):
        result = pipeline.process(MASK)
    assert result.frame is None
    for background in (None, MASK, dloftbs.Frame(mask=MASK)):
        assert "#1, " in viz.show(result, background).svg


def test_a_reason_is_written_and_escaped():
    result = dloftbs.FrameResult((), (), "the mask is <empty> & so on", SIZE)
    assert "the mask is &lt;empty&gt; &amp; so on" in viz.show(result).svg


@pytest.mark.parametrize("given", [np.zeros((3, 4), np.uint8), "x.png"])
def test_another_picture_is_refused(given):
    with pytest.raises(InputError):
        viz.show(dloftbs.detect(MASK), given)


def test_what_is_no_result_is_refused():
    with pytest.raises(InputError, match="result must be a FrameResult"):
        viz.show(MASK)
