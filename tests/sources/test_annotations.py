"""Files of annotation tools and data sets: COCO, SAM, labelme, YOLO."""

from __future__ import annotations

import base64
import contextlib
import json
import logging
from pathlib import Path

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import array_shapes, arrays

from dloftbs import SourceError
from dloftbs.data.run_lengths import encode
from dloftbs.sources.annotations import CocoFile, read_annotations, read_coco

SIZE = (20, 30)
BAR = [2.0, 3.0, 25.0, 3.0, 25.0, 6.0, 2.0, 6.0]
POST = [10.0, 1.0, 13.0, 1.0, 13.0, 18.0, 10.0, 18.0]
PAIRS = [[[x, y] for x, y in zip(one[::2], one[1::2], strict=True)] for one in (BAR, POST)]


def expected() -> np.ndarray:
    """Return the label image of the bar and the post, outlines included; the post is smaller."""
    labels = np.zeros(SIZE, np.uint16)
    labels[3:7, 2:26] = 1
    labels[1:19, 10:14] = 2
    return labels


def mask(number: int) -> np.ndarray:
    canvas = np.zeros(SIZE, np.uint8)
    cv2.fillPoly(canvas, [np.array(PAIRS[number], np.int32)], 1)
    return canvas


def coco(segmentations: list, name: str = "a.png") -> dict:
    annotations = [{"id": k, "image_id": 5, "segmentation": one} for k, one in enumerate(segmentations)]
    return {"images": [{"id": 5, "file_name": name, "height": 20, "width": 30}], "annotations": annotations}


def labelme(*shapes: dict) -> dict:
    return {"version": "5.4.1", "flags": {}, "shapes": shapes, "imageHeight": 20, "imageWidth": 30, "imageData": None}


def shape(points: list, kind: str = "polygon", **more: object) -> dict:
    return {"label": "rope", "points": points, "group_id": None, "shape_type": kind, "flags": {}, **more}


def as_png(pixels: np.ndarray) -> str:
    return base64.b64encode(cv2.imencode(".png", pixels)[1].tobytes()).decode()


def save(path: Path, content: object) -> Path:
    path.write_text(content if isinstance(content, str) else json.dumps(content), encoding="utf-8")
    return path


def yolo(*polygons: list[float]) -> str:
    return "\n".join(
        " ".join(["0", *(f"{v / SIZE[1 - i % 2]:.6f}" for i, v in enumerate(polygon))]) for polygon in polygons
    )


@pytest.mark.parametrize(
    "content",
    [
        coco([[BAR], [POST]]),
        coco([BAR, POST]),
        coco([encode(mask(0)), [POST]]),
        coco([{"size": [20, 30], "counts": [43, *[4, 16] * 23, 4, 93]}, encode(mask(1))]),
        {
            "image": {"file_name": "sa_1.jpg", "height": 20, "width": 30},
            "annotations": coco([[BAR], [POST]])["annotations"],
        },
        [{"segmentation": encode(mask(number)), "area": 5, "bbox": [1, 2, 3, 4]} for number in (0, 1)],
        [encode(mask(number)) for number in (0, 1)],
        [{"image_id": 7, "category_id": 1, "score": 0.9, "segmentation": encode(mask(number))} for number in (0, 1)],
        {**coco([[BAR], [POST]]), "images": [{"id": "5", "file_name": "a.png", "height": 20, "width": 30}]},
        {**coco([[BAR], [POST]]), "images": [{"file_name": "a.png", "height": 20, "width": 30}]},
        labelme(shape(PAIRS[0]), shape(PAIRS[1])),
        {**labelme(shape(PAIRS[0]), shape(PAIRS[1])), "imageHeight": 20.0, "imageWidth": 30.0},
        labelme(shape(PAIRS[0]), shape([[10, 1], [13, 18]], "mask", mask=as_png(np.full((18, 4), 255, np.uint8)))),
    ],
)
def test_every_format_of_json_gives_the_same_label_image(tmp_path, content):
    path = save(tmp_path / "a.json", content)
    np.testing.assert_array_equal(read_annotations(path), expected())
    np.testing.assert_array_equal(read_annotations(path, SIZE), expected())


def test_lines_of_yolo(tmp_path):
    path = save(tmp_path / "a.txt", yolo(BAR, POST) + "\n\n")
    np.testing.assert_array_equal(read_annotations(path, SIZE), expected())
    np.testing.assert_array_equal(read_annotations(save(path, ""), SIZE), np.zeros(SIZE))  # a picture without a cable


@pytest.mark.parametrize("ends", [("0.87", "0.5"), ("1", "2"), ("0.87 7", "0.5 1"), ("1 1", "1 2"), ("0 14", "0.5 1")])
def test_lines_of_yolo_may_end_with_a_confidence_and_the_number_of_a_track(tmp_path, ends):
    lines = [f"{line} {end}" for line, end in zip(yolo(BAR, POST).splitlines(), ends, strict=True)]
    path = save(tmp_path / "a.txt", "\n".join(lines))
    np.testing.assert_array_equal(read_annotations(path, SIZE), expected())
    path = save(tmp_path / "b.txt", lines[1])
    np.testing.assert_array_equal(read_annotations(path, SIZE), mask(1))


def test_boxes_with_a_confidence_or_the_number_of_a_track_are_boxes(tmp_path, caplog):
    for first, second in (("", ""), (" 0.9", " 0.8"), (" 3", " 4"), (" 0.9 3", " 0.8 4")):
        path = save(tmp_path / "a.txt", f"0 0.5 0.5 0.1 0.2{first}\n0 0.2 0.5 0.1 1.0{second}")
        assert not read_annotations(path, SIZE).any()
        assert caplog.messages == [f"{path}: left out 2 boxes (line 1): only polygons have an area"]
        caplog.clear()


def test_a_last_corner_at_the_lower_border_is_no_track(tmp_path):
    cut = [10, 20, 10, 4, 14, 4, 14, 20]
    (line,) = yolo(cut).splitlines()
    labels = np.zeros(SIZE, np.uint16)
    labels[4:, 10:15] = 1
    np.testing.assert_array_equal(read_annotations(save(tmp_path / "a.txt", line), SIZE), labels)
    np.testing.assert_array_equal(read_annotations(save(tmp_path / "b.txt", f"{line} 0.5 1"), SIZE), labels)
    both = "\n".join([line, yolo([20, 20, 20, 4, 24, 4, 24, 20])])
    labels[4:, 20:25] = 2
    np.testing.assert_array_equal(read_annotations(save(tmp_path / "c.txt", both), SIZE), labels)


def test_polygons_of_one_annotation_and_shapes_of_one_group_are_one_object(tmp_path):
    whole = (expected() > 0).astype(np.uint16)
    np.testing.assert_array_equal(read_annotations(save(tmp_path / "a.json", coco([[BAR, POST]]))), whole)
    grouped = labelme(shape(PAIRS[0], group_id=3), shape(PAIRS[1], group_id=3))
    np.testing.assert_array_equal(read_annotations(save(tmp_path / "b.json", grouped)), whole)


@pytest.mark.parametrize("left", [-2, 0, 27])
def test_a_mask_of_labelme_is_cut_at_the_border(tmp_path, left):
    pixels = np.full((3, 5), 1, np.uint8)
    content = labelme(shape([[left, 4], [left + 4, 6]], "mask", mask=as_png(pixels)))
    labels = np.zeros(SIZE, np.uint16)
    labels[4:7, max(left, 0) : left + 5] = 1
    np.testing.assert_array_equal(read_annotations(save(tmp_path / "a.json", content)), labels)


def test_a_line_with_a_width_is_drawn(tmp_path):
    wire = shape([[2.2, 10], [27.4, 10]], "linestrip", description="width_px=5.0")
    labels = read_annotations(save(tmp_path / "a.json", labelme(wire)))
    assert (labels[8:13, 3:28] == 1).all()
    assert not labels[[7, 13]].any()
    assert not labels[:, [2, 28]].any()


@pytest.mark.parametrize("width_px", [1.0, 2.99, 6.93, 11.07])
def test_a_line_is_as_wide_as_it_says(tmp_path, width_px):
    points = [[12.3, 15.4], [60.9, 44.1], [60.9, 44.1], [110.2, 20.7]]
    content = labelme(shape(points, "linestrip", description=f"width_px={width_px}"))
    labels = read_annotations(save(tmp_path / "a.json", {**content, "imageHeight": 60, "imageWidth": 120}))
    length_px = np.hypot(*np.diff(points, axis=0).T).sum()
    assert labels.sum() / length_px == pytest.approx(width_px, abs=0.1)


def test_a_line_that_ends_at_its_first_point_is_a_loop_without_ends(tmp_path):
    square = [[8, 4], [22, 4], [22, 15], [8, 15], [8, 4]]
    content = labelme(shape(square, "linestrip", description="width_px=3"))
    expected = np.zeros(SIZE, np.uint16)
    expected[3:17, 7:24] = 1
    expected[6:14, 10:21] = 0
    expected[[3, 3, 16, 16], [7, 23, 7, 23]] = 1  # 1.41 px from the corners
    np.testing.assert_array_equal(read_annotations(save(tmp_path / "a.json", content)), expected)


@pytest.mark.parametrize("parts", [[[5, 5, 6, 6]], [[5, 5]], [[]], [POST, [5, 5, 6, 6]]])
def test_parts_below_three_corners_are_left_out_with_a_warning(tmp_path, caplog, parts):
    path = save(tmp_path / "a.json", coco([[BAR], parts]))
    whole = expected() if POST in parts else mask(0)
    np.testing.assert_array_equal(read_annotations(path), whole)
    assert f"{path}: left out a polygon of {len(parts[-1]) // 2} corners: three or more have an area" in caplog.text


@pytest.mark.parametrize("points", [[[5, 5], [6, 6]], [[5, 5]], []])
def test_shapes_of_labelme_without_an_area_are_left_out_with_a_warning(tmp_path, caplog, points):
    path = save(tmp_path / "a.json", labelme(shape(PAIRS[0]), shape(points), shape(PAIRS[1])))
    np.testing.assert_array_equal(read_annotations(path), np.array([0, 1, 3])[expected()])
    assert f"{path}: left out a polygon of {len(points)} corners" in caplog.text
    line = shape(points[:1] * 2, "linestrip", description="width_px=5.0")
    path = save(tmp_path / "b.json", labelme(shape(PAIRS[0]), shape(PAIRS[1]), line))
    np.testing.assert_array_equal(read_annotations(path), expected())
    assert f"{path}: left out a linestrip: it has no two points that differ" in caplog.text


def test_lines_and_boxes_have_no_area_and_are_left_out_with_a_warning(tmp_path, caplog):
    content = labelme(shape([[1, 1], [9, 9]], "linestrip", label="wire"), shape(PAIRS[0]), shape(PAIRS[1]))
    np.testing.assert_array_equal(read_annotations(save(tmp_path / "a.json", content)), expected())
    assert "left out the linestrip 'wire': only polygons, masks, and lines that are described by" in caplog.text
    path = save(tmp_path / "a.txt", "0 0.5 0.5 0.1 0.2\n" + yolo(BAR, POST))
    np.testing.assert_array_equal(read_annotations(path, SIZE), expected())
    assert "left out 1 boxes (line 1)" in caplog.text


@given(arrays(bool, array_shapes(min_dims=2, max_dims=2, min_side=1, max_side=12)), st.booleans())
def test_run_lengths_in_a_file_come_back(tmp_path_factory, pixels, listed):
    path = tmp_path_factory.getbasetemp() / "lengths.json"
    run_lengths = encode(pixels)
    if listed:
        columns = pixels.T.ravel().astype(int)
        changes = np.flatnonzero(np.diff(columns)) + 1
        run_lengths["counts"] = np.diff(changes, prepend=[0] * (1 + columns[0]), append=columns.size).tolist()
    np.testing.assert_array_equal(read_annotations(save(path, [{"segmentation": run_lengths}])), pixels)


@given(arrays(bool, (8, 9)))
def test_the_outlines_of_a_mask_fill_to_it(tmp_path_factory, pixels):
    """Polygons as `cv2.findContours` gives them, which is how segmenters write them, come back but for holes."""
    outlines, _ = cv2.findContours(pixels.astype(np.uint8), cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
    polygons = [one.ravel().tolist() for one in outlines if len(one) > 2]
    filled = np.zeros((8, 9), np.uint8)
    cv2.drawContours(filled, [one for one in outlines if len(one) > 2], -1, 1, cv2.FILLED)
    document = {
        "images": [{"id": 5, "height": 8, "width": 9}],
        "annotations": [{"image_id": 5, "segmentation": polygons}],
    }
    path = save(tmp_path_factory.getbasetemp() / "outlines.json", document)
    np.testing.assert_array_equal(read_annotations(path), filled)


@pytest.mark.parametrize(
    ("name", "content", "message"),
    [
        ("a.json", "{", "a.json: "),
        ("a.json", "5", "a.json: "),
        ("a.json", {"images": 5}, r"a.json: .*\$\.images"),
        ("a.json", {"a": 1}, r"must be JSON of labelme \('shapes'\), of SAM, or of COCO with one image"),
        ("a.json", {**coco([]), "images": []}, "of COCO with one image"),
        ("a.json", [], "does not say the size of the picture"),
        ("a.json", {**labelme(), "imageHeight": -5}, r"size of the picture must be two positive integers"),
        ("a.json", {**labelme(), "imageHeight": 10**40}, r"size of the picture must be two positive integers"),
        ("a.json", [{"segmentation": {"size": [0, 5], "counts": []}}], r"size of the picture must be two positive"),
        ("a.json", [{"bbox": [1, 2, 3, 4]}], r"\[0\] must have the key 'segmentation', or 'size' and 'counts'; a box"),
        (
            "a.json",
            [{"image_id": number, "segmentation": encode(mask(number))} for number in (0, 1)],
            "must hold the masks of one image, got a list with 2 different image_id; give COCO's file with 'images'",
        ),
        ("a.json", coco([5]), "a segmentation must be run lengths or polygons, got 5"),
        ("a.json", coco([[[1, 2, 3, 4, 5]]]), "a polygon must be pairs of numbers"),
        ("a.json", coco([[["a", "b"] * 3]]), "a polygon must be pairs of numbers"),
        ("a.json", coco([[[1e300, 0, 5, 5, 0, 5]]]), "a polygon must be in pixels, -134217728 to 134217728"),
        ("a.json", coco([{"size": [20, 30], "counts": "~"}]), "compressed counts must be"),
        ("a.json", coco([{"size": [90000, 90000], "counts": [8100000000]}]), r"must have the size \(20, 30\)"),
        ("a.json", [{"segmentation": {"size": [90000, 90000], "counts": [8100000000]}}], "at most 134217728 pixels"),
        ("a.json", labelme(shape([[1, 1], [2, 2]], "mask", mask="?")), "a mask must be a PNG between two corners"),
        ("a.json", labelme(shape([[1, 1]], "mask", mask=as_png(np.ones((2, 2), np.uint8)))), "between two corners"),
        ("a.json", labelme(shape([[1, 1], [2, 2]], "mask", mask=base64.b64encode(b"a").decode())), "cannot be decoded"),
        (
            "a.txt",
            "31 279 244 271 232 263 217\n",
            r"line 1 must have coordinates in 0\.\.1, shares of the picture's size",
        ),
        ("a.txt", "0 0.1 0.2 0.3\n", "line 1 must be a class and three points or more, .* got 4 numbers"),
        ("a.txt", "0 .1 .2 .3 .4 .5 .6 -.7\n", r"behind which a confidence in 0\.\.1 and .* a track may stand, got 8"),
        ("a.txt", "0 .1 .2 .3 .4 .5 .6 2.5\n", r"behind which a confidence in 0\.\.1 and .* a track may stand, got 8"),
        ("a.txt", "0 .1 .2 .3 .4 .5 .6 .7 2 .8\n", "line 1 must have coordinates"),
        ("a.txt", "0 nan 0.2 0.3 0.1 0.5 0.5\n", "line 1 must have coordinates"),
        ("a.txt", "cable 0.1\n", "is no text of YOLO"),
        ("none.json", None, "none.json: cannot be read"),
    ],
)
def test_what_is_wrong_in_a_file_is_said_with_its_name(tmp_path, name, content, message):
    path = tmp_path / name
    if content is not None:
        save(path, content)
    with pytest.raises(SourceError, match=message):
        read_annotations(path, SIZE if name == "a.txt" else None)


def test_a_file_for_pictures_of_another_size_is_refused(tmp_path):
    for content in (labelme(shape(PAIRS[0])), coco([[BAR]])):
        with pytest.raises(
            SourceError, match=r"is for pictures of the size \(20, 30\) .*, and the frame has \(40, 60\)"
        ):
            read_annotations(save(tmp_path / "a.json", content), (40, 60))
    with pytest.raises(SourceError, match="shares of the picture's size, which is needed beside it"):
        read_annotations(save(tmp_path / "a.txt", yolo(BAR)))


class TestCocoFile:
    @pytest.fixture
    def file(self, tmp_path) -> CocoFile:
        """Return a file with the pictures run1/a.png, run2/a.png and b.png, of which the last has no annotation."""
        names = ["run1/a.png", "run2\\a.png", "b.png"]
        images = [{"id": k, "file_name": name, "height": 20, "width": 30} for k, name in enumerate(names)]
        annotations = [{"image_id": 0, "segmentation": [BAR]}, {"image_id": 1, "segmentation": [POST]}]
        found = read_coco(save(tmp_path / "coco.json", {"images": images, "annotations": annotations, "licenses": []}))
        assert found is not None
        return found

    def test_frames_are_known_by_their_names(self, file):
        assert not file.read(Path("anywhere/b.png"), SIZE).any()
        np.testing.assert_array_equal(file.read(Path("/data/run1/a.png"), SIZE), mask(0))
        np.testing.assert_array_equal(file.read(Path("/data/run2/a.png"), SIZE), mask(1))

    @pytest.mark.parametrize(
        ("frame", "message"), [("c.png", r"has no image that is named 'c\.png'"), ("x/a.png", "has no image that is")]
    )
    def test_a_frame_that_is_not_there_is_said(self, file, frame, message):
        with pytest.raises(SourceError, match=message):
            file.read(Path(frame), SIZE)

    def test_a_file_of_other_frames_is_refused_at_once(self, file):
        file.check_names([Path("c.png"), Path("b.png")])
        with pytest.raises(
            SourceError, match=r"no file_name is that of a frame, such as 'c\.png'; it has such as 'a\.png'"
        ):
            file.check_names([Path("c.png")])

    def test_an_annotation_that_is_wrong_harms_its_own_frame_alone(self, tmp_path):
        content = {
            "images": [{"id": k, "file_name": f"{k}.png", "height": 20, "width": 30} for k in range(2)],
            "annotations": [{"image_id": 0, "segmentation": "?"}, {"image_id": 1, "segmentation": [POST]}],
        }
        found = read_coco(save(tmp_path / "coco.json", content))
        assert found is not None
        with pytest.raises(SourceError, match=r"coco\.json: 0\.png: a segmentation must be run lengths or polygons"):
            found.read(Path("0.png"), SIZE)
        np.testing.assert_array_equal(found.read(Path("1.png"), SIZE), mask(1))

    def test_boxes_alone_are_no_objects_but_keep_their_numbers(self, tmp_path, caplog):
        content = coco([[BAR], None, [POST], []])
        content["annotations"].append({"image_id": 5, "bbox": [1, 2, 3, 4]})
        found = read_coco(save(tmp_path / "coco.json", content))
        assert found is not None
        assert "left out 3 of 5 annotations, which have no segmentation" in caplog.text
        np.testing.assert_array_equal(found.read(Path("a.png"), SIZE), np.array([0, 1, 3])[expected()])

    @pytest.mark.parametrize(("of_image", "of_annotation"), [(1, "1"), ("1", 1), ("1", "1"), (1.0, 1), ("a", "a")])
    def test_an_id_may_be_a_number_or_its_text(self, tmp_path, caplog, of_image, of_annotation):
        content = {
            "images": [{"id": of_image, "file_name": "a.png"}, {"id": 2, "file_name": "b.png"}],
            "annotations": [{"image_id": of_annotation, "segmentation": [BAR]}],
        }
        found = read_coco(save(tmp_path / "coco.json", content))
        assert found is not None
        np.testing.assert_array_equal(found.read(Path("a.png"), SIZE), mask(0))
        assert not found.read(Path("b.png"), SIZE).any()
        assert caplog.messages == []

    def test_annotations_of_no_image_are_left_out_with_a_warning(self, tmp_path, caplog):
        content = coco([[BAR], [POST], [POST]])
        content["annotations"][1]["image_id"] = 6
        content["annotations"][2]["image_id"] = "05"
        path = save(tmp_path / "coco.json", content)
        found = read_coco(path)
        assert found is not None
        message = f"{path}: left out 2 of 3 annotations, whose image_id is the id of no image"
        assert caplog.messages == [message]
        np.testing.assert_array_equal(found.read(Path("a.png"), SIZE), mask(0))
        np.testing.assert_array_equal(found.read(None, SIZE), mask(0))
        np.testing.assert_array_equal(read_annotations(path), mask(0))
        assert caplog.messages == [message] * 2

    def test_another_format_is_none(self, tmp_path):
        assert read_coco(save(tmp_path / "a.json", labelme(shape(PAIRS[0])))) is None
        with pytest.raises(SourceError, match=r"a\.json"):
            read_coco(save(tmp_path / "a.json", "{"))


@pytest.fixture(autouse=True)
def log(caplog):
    caplog.set_level(logging.WARNING, "dloftbs.sources")
    return caplog


VALID = [
    json.dumps(coco([[BAR], encode(mask(1))])),
    json.dumps([{"segmentation": encode(mask(0))}]),
    json.dumps(labelme(shape(PAIRS[0]), shape([[10, 1], [13, 18]], "mask", mask=as_png(np.ones((18, 4), np.uint8))))),
    yolo(BAR, POST),
]


@given(
    st.sampled_from(VALID), st.lists(st.tuples(st.integers(0, 5000), st.binary(max_size=3)), max_size=4), st.booleans()
)
def test_bytes_that_are_changed_give_labels_or_an_error_of_ours(tmp_path_factory, text, changes, is_known):
    data = bytearray(text.encode())
    for at, new in changes:
        at %= len(data) + 1
        data[at : at + len(new)] = new
    path = tmp_path_factory.getbasetemp() / ("changed.txt" if text == VALID[-1] else "changed.json")
    path.write_bytes(data)
    with contextlib.suppress(SourceError):
        labels = read_annotations(path, SIZE if is_known else None)
        assert labels.dtype == np.uint16
        assert labels.shape == SIZE or not is_known
