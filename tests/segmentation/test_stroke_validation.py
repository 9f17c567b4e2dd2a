"""What is found beneath each stroke by the others."""

from busy_pictures import busy

from dloftbs.segmentation import Stroke, cross_validate, stroke_widths


def test_the_width_beneath_each_stroke_is_measured_once(monkeypatch):
    measured, axis = [], stroke_widths._axis
    monkeypatch.setattr(stroke_widths, "_axis", lambda lab, stroke: measured.append(stroke) or axis(lab, stroke))
    strokes = [Stroke(points=[(x, 100), (x + 60, 100)]) for x in (20, 90, 160, 230)]
    assert cross_validate(busy()[0], strokes) is not None
    assert measured == strokes
