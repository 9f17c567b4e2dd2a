"""Polylines as JSON and CSV beside images: true curves through the points."""

from __future__ import annotations

import json
import logging
import pickle
import re

import numpy as np
import pytest
from recorded_examples import CAMERA, SIZE, assert_same_bits, picture, save

from dloftbs.errors import InputError, SourceError
from dloftbs_lab import open_labelled
from dloftbs_lab.recorded.through_points import curve_through

BEND = [[2, 3], [8, 6.5], [15, 7], [24, 4], [33, 12]]
SHORT = [[4.25, 20], [30, 22]]


def fill(folder, text, suffix=".json", pixels=None):
    save(folder / "a.png", picture() if pixels is None else pixels)
    (folder / f"a{suffix}").write_text(text)
    return folder


def distance(curve, points):
    """Return how far the points are from a fine sample of the curve, at most."""
    samples = curve.sample(20001)
    return max(np.linalg.norm(samples - point, axis=1).min() for point in np.asarray(points, float))


@pytest.mark.parametrize(("count", "degree"), [(2, 1), (3, 2), (4, 3), (5, 3), (40, 3)])
@pytest.mark.parametrize("ndim", [2, 3])
def test_a_curve_runs_through_its_points(count, degree, ndim):
    points = np.cumsum(np.random.default_rng(count).uniform(1, 9, (count, ndim)), axis=0)
    curve = curve_through(points)
    assert (curve.degree, curve.closed, curve.ndim) == (degree, False, ndim)
    np.testing.assert_allclose(curve([0.0, 1.0]), points[[0, -1]], atol=1e-9)
    u = np.concatenate(([0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))))
    np.testing.assert_allclose(curve.spline(u / u[-1]), points, atol=1e-9)


def test_the_parameter_is_the_arc_length():
    angle = np.linspace(0.0, 5.0, 40) ** 2 / 5.0
    curve = curve_through(np.stack((np.cos(angle), np.sin(angle)), axis=1) * 90)
    speed = np.linalg.norm(curve(np.linspace(0, 1, 500), 1), axis=1)
    np.testing.assert_allclose(speed, curve.length, rtol=0.01)


@pytest.mark.parametrize("count", [4, 5, 24])
def test_points_that_return_to_the_first_make_a_loop(count):
    angle = np.arange(count + 1) / count * 2 * np.pi
    points = np.stack((np.cos(angle), np.sin(angle)), axis=1) * 90
    points[-1] = points[0]
    curve = curve_through(points)
    assert curve.closed
    assert curve.length == pytest.approx(2 * np.pi * 90, rel=0.05)
    assert distance(curve, points) < 0.02


def test_repeated_points_count_once():
    assert curve_through([[0, 0], [0, 0], [4, 1], [4, 1], [9, 0]]) == curve_through([[0, 0], [4, 1], [9, 0]])


@pytest.mark.parametrize(
    ("points", "message"),
    [
        ([], r"must have shape .*, got \(0,\)"),
        ([[1, 1]], "needs 2 points or more that differ, got 1"),
        ([[1, 1], [1, 1]], "needs 2 points or more that differ, got 1"),
        ([[1, 1], [np.nan, 2]], "must be finite"),
        ([[1], [2]], r"must have shape .*, got \(2, 1\)"),
        ([[1, 2], [3]], "must be an array of numbers"),
    ],
)
def test_points_that_make_no_curve_are_refused(points, message):
    with pytest.raises(InputError, match=message):
        curve_through(points)


@pytest.mark.parametrize("ids", [None, [4, 2]])
def test_json_with_curves_and_ids(tmp_path, ids):
    known = {"curves": [BEND, SHORT]} | ({"ids": ids} if ids else {})
    truth = open_labelled(fill(tmp_path, json.dumps(known)), "polylines").truth(0)
    assert truth.ids == tuple(ids or (1, 2))
    assert truth.curves == (curve_through(BEND), curve_through(SHORT))
    assert (truth.visible_masks, truth.curves_3d) == ((), ())


def test_json_with_only_the_curves(tmp_path):
    truth = open_labelled(fill(tmp_path, json.dumps([SHORT]))).truth(0)
    assert (truth.curves, truth.ids) == ((curve_through(SHORT),), (1,))


def test_an_image_may_show_nothing(tmp_path):
    assert open_labelled(fill(tmp_path, "[]")).truth(0).ids == ()


def table(z=None):
    lines = ["object,x,y" + (",z" if z else "")]
    for number, points in ((3, BEND), (1, SHORT)):
        lines += [f"{number},{x},{y}" + (f",{z}" if z else "") for x, y in points]
    return "\n".join(lines) + "\n"


def test_csv(tmp_path):
    truth = open_labelled(fill(tmp_path, table(), ".csv")).truth(0)
    assert (truth.ids, truth.curves) == ((3, 1), (curve_through(BEND), curve_through(SHORT)))


def test_depth_and_camera_make_curves_in_space(tmp_path):
    fill(tmp_path, table(z=0.8), ".csv")
    assert open_labelled(tmp_path).truth(0).curves_3d == ()
    camera = {name: getattr(CAMERA, name) for name in ("fx", "fy", "cx", "cy")}
    (tmp_path / "camera.json").write_text(json.dumps(camera))
    sequence = open_labelled(tmp_path)
    truth = sequence.truth(0)
    assert sequence.frame(0).camera == CAMERA
    np.testing.assert_allclose(truth.curves_3d[0].sample(50)[:, 2], 0.8)
    assert distance(truth.curves[0], CAMERA.project(truth.curves_3d[0].sample(50))) < 0.02


def test_a_missing_depth_leaves_the_curves_in_the_image(tmp_path):
    fill(tmp_path, json.dumps([[[1, 2, 0.5], [9, 9, 0.0]]]))
    (tmp_path / "camera.json").write_text('{"fx": 1, "fy": 1, "cx": 0, "cy": 0}')
    truth = open_labelled(tmp_path).truth(0)
    assert (len(truth.curves), truth.curves_3d) == (1, ())


def test_a_grey_picture_is_a_mask(tmp_path):
    mask = (np.arange(np.prod(SIZE)).reshape(SIZE) % 3).astype(np.uint8)
    frame = open_labelled(fill(tmp_path, "[]", pixels=mask)).frame(0)
    assert frame.image is None
    assert_same_bits(frame.mask, mask)


def test_a_mask_depth_and_occluders_may_lie_beside_the_image(tmp_path):
    fill(tmp_path, "[]")
    mask, depth = np.eye(*SIZE, dtype=np.uint8), np.full(SIZE, 1.5, np.float32)
    save(tmp_path / "a.mask.png", mask)
    np.save(tmp_path / "a.depth.npy", depth)
    save(tmp_path / "a.occluders.png", mask[::-1].copy())
    (frame,) = open_labelled(tmp_path)
    assert_same_bits(frame.image, picture())
    assert_same_bits(frame.mask, mask)
    assert_same_bits(np.asarray(frame.depth), depth)
    assert_same_bits(np.asarray(frame.occluders), mask[::-1])


@pytest.mark.parametrize(
    ("text", "suffix", "message"),
    [
        ('{"curves": 3}', ".json", "a.json: Expected `array`, got `int` - at `$.curves`"),
        ('{"lines": []}', ".json", "a.json: Object missing required field `curves`"),
        ("[[[1, 2], [3, 4]]", ".json", "a.json: Input data was truncated"),
        ('[[[1, 2], ["a", 4]]]', ".json", "a.json: Expected `float`, got `str`"),
        ("[[[1, 2]]]", ".json", "a.json: a curve needs 2 points or more"),
        ("[[[1, 2], [3, 4, 5]]]", ".json", "a.json: polyline 0 must be an array of numbers"),
        ("[[[1, 2], [3, 4]], [[1, 2, 3], [3, 4, 5]]]", ".json", "a.json: polylines must be all with depth"),
        ('{"curves": [[[1, 2], [3, 4]]], "ids": [1, 2]}', ".json", "must be none or one for each of 2 ids"),
        ('{"extra": ' + "[" * 20_000, ".json", "a.json: lists and mappings are nested too deeply"),
        ("[[[1, 2], [3, 1" + "0" * 400 + "]]]", ".json", "a.json: Number out of range"),
        ('{"curves": [[[1, 2], [3, 4]]], "ids": [1' + "0" * 20 + "]}", ".json", "a.json: Expected `int` <= "),
        ("object,x,y\n1e300,2,3\n", ".csv", "a.csv, line 2: object must be a whole number, got '1e300'"),
        ("object,x\n1,2\n", ".csv", "a.csv: lacks the column y; found object, x"),
        ("object,x,y\n1,2\n", ".csv", "a.csv, line 2: has 2 fields instead of 3"),
        ("", ".csv", "a.csv: lacks the columns object, x, y; found none"),
        ("x" * 900, ".csv", f"a.csv: lacks the columns object, x, y; found {'x' * 100}..."),
        ("a,b,c,d,e,f,g", ".csv", "a.csv: lacks the columns object, x, y; found a, b, c, d, e and 2 more"),
        ("object,x,y\n1,2,3\n1,2\n", ".csv", "a.csv, line 3: has 2 fields instead of 3"),
        ("object,x,y\n1,2,3\n1,zwei,3\n", ".csv", "a.csv, line 3: x must be a number, got 'zwei'"),
        ("object,x,y\n1,2,inf\n", ".csv", "a.csv, line 2: y must be a number, got 'inf'"),
        ("object,x,y\n1.5,2,3\n", ".csv", "a.csv, line 2: object must be a whole number, got '1.5'"),
        ("object,x,y\n1,2,3\n", ".csv", "a.csv: a curve needs 2 points or more"),
    ],
)
def test_corrupt_truth_is_named(tmp_path, text, suffix, message):
    sequence = open_labelled(fill(tmp_path, text, suffix))
    with pytest.raises(SourceError, match=re.escape(message)):
        sequence.truth(0)
    sequence.frame(0)


def test_text_that_is_none_is_named(tmp_path):
    fill(tmp_path, "", ".csv")
    (tmp_path / "a.csv").write_bytes(b"object,x,y\n1,\xff\xfe,3\n")
    with pytest.raises(SourceError, match=re.escape("a.csv")):
        open_labelled(tmp_path).truth(0)


def test_truth_without_an_image_is_an_error(tmp_path):
    (fill(tmp_path, "[]") / "b.json").write_text("[]")
    with pytest.raises(SourceError, match=re.escape("1 of 2 lack an image")):
        open_labelled(tmp_path)


def test_two_truths_of_one_image_are_an_error(tmp_path):
    (fill(tmp_path, "[]") / "a.csv").write_text(table())
    with pytest.raises(SourceError, match=re.escape("a.csv and a.json are the truth of one image")):
        open_labelled(tmp_path)


def test_two_images_of_one_stem_are_an_error(tmp_path):
    save(fill(tmp_path, "[]") / "a.jpg", picture())
    with pytest.raises(SourceError, match=re.escape("got a.jpg and a.png") + ".* name that a.mask.png"):
        open_labelled(tmp_path)


def test_images_without_truth_are_left_out_and_said(tmp_path, caplog):
    save(fill(tmp_path, "[]") / "b.png", picture())
    with caplog.at_level(logging.WARNING, "dloftbs.sources"):
        assert len(open_labelled(tmp_path)) == 1
    assert "left out 1 images without truth: b.png" in caplog.text


def test_an_image_that_is_gone_is_named(tmp_path):
    sequence = pickle.loads(pickle.dumps(open_labelled(fill(tmp_path, "[]"))))
    (tmp_path / "a.png").unlink()
    with pytest.raises(SourceError, match=re.escape("a.png: cannot be read")):
        sequence.frame(0)
