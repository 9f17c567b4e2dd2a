"""Labels for training: COCO's masks and labelme's lines, read back with nothing but JSON."""

from __future__ import annotations

import json
from dataclasses import replace

import builders
import cv2
import numpy as np
import pytest
import sinks.sink_examples as examples

from dloftbs import Pipeline, sinks
from dloftbs.data.centerline import Centerline, Joint, JointKind, Segment
from dloftbs.data.detection import Detection
from dloftbs.data.frame import Frame
from dloftbs.data.frame_result import FrameResult
from dloftbs.data.run_lengths import decode
from dloftbs.data.tracks import Track, TrackState
from dloftbs.errors import InputError, SinkError
from dloftbs.sources.annotations import read_annotations

SIZE = (60, 90)
WIDTH = 5


def straight(start, end, gap=None):
    """A detection of a straight cable, and of which share no pixel is seen."""
    curve = builders.line(start, end)
    points = curve.sample(20)
    radii = np.full(10, 0.5 * WIDTH)
    if gap is None:
        return Detection(Centerline((Segment(points, np.full(20, 0.5 * WIDTH)),), ()), curve)
    segments = (Segment(points[:10], radii), Segment(points[10:], radii))
    span = tuple(curve.t_at(gap).tolist())
    return Detection(Centerline(segments, (Joint(JointKind.GAP, span, 1.0, 3.0, 0.75),)), curve)


def bar(rows, columns):
    mask = np.zeros(SIZE, dtype=bool)
    mask[rows[0] : rows[1] + 1, columns[0] : columns[1] + 1] = True
    return mask


def result_of(*detections, tracks=(), index=0, name=""):
    return FrameResult(detections, tracks, None, SIZE, index=index, name=name)


def frame(index=0, name=""):
    return examples.frame(index, SIZE, name)


def written(path, *results):
    with sinks.open(path) as sink:
        for result in results:
            sink.write(frame(result.index, result.name), result)
    return json.loads(path.read_text()) if path.suffix == ".json" else path


UPPER = straight((9.75, 20.0), (50.25, 20.0))
LOWER = straight((9.75, 40.0), (50.25, 40.0), gap=(0.26, 0.49))  # from 20.28 to 29.595


def test_a_mask_is_the_drawn_curve(tmp_path):
    content = written(tmp_path / "new" / "labels.json", result_of(UPPER, LOWER, name="photo.png"))

    assert content["images"] == [{"id": 1, "file_name": "photo.png", "width": 90, "height": 60}]
    assert content["categories"] == [{"id": 1, "name": "cable"}]
    upper, lower = content["annotations"]
    assert {key: upper[key] for key in upper if key != "segmentation"} == {
        **{"id": 1, "image_id": 1, "category_id": 1, "iscrowd": 0},
        **{"area": 41 * 5, "bbox": [10, 18, 41, 5]},
    }
    assert (decode(upper["segmentation"]) == bar((18, 22), (10, 50))).all()
    assert lower["id"] == 2
    assert (decode(lower["segmentation"]) == bar((38, 42), (10, 20)) | bar((38, 42), (30, 50))).all()
    assert lower["area"] == decode(lower["segmentation"]).sum()
    assert lower["bbox"] == [10, 38, 41, 5]


def test_frames_keep_their_order_and_their_names(tmp_path):
    results = [
        result_of(UPPER, name="cable.mp4#7", index=7),
        result_of(index=8, name="caf\udce9.png"),
        result_of(LOWER, index=9),
    ]
    content = written(tmp_path / "labels.json", *results)

    assert [(image["id"], image["file_name"]) for image in content["images"]] == [
        (1, "cable.mp4#7"),
        (2, "caf\\xe9.png"),
        (3, "000009"),
    ]
    assert [(one["id"], one["image_id"]) for one in content["annotations"]] == [(1, 1), (2, 3)]


def test_without_a_frame_the_lists_are_empty(tmp_path):
    assert written(tmp_path / "labels.json") == {
        "images": [],
        "annotations": [],
        "categories": [{"id": 1, "name": "cable"}],
    }


def test_parts_of_a_track_that_are_remembered_are_not_in_the_mask(tmp_path):
    whole = builders.line((9.75, 20.0), (70.25, 20.0))
    tracks = (
        Track(3, TrackState.CONFIRMED, whole, None, 5, 0, UPPER, inferred=((0.67, 1.0),)),
        Track(4, TrackState.CONFIRMED, LOWER.curve.reversed(), None, 5, 0, LOWER.reversed()),
        Track(9, TrackState.HIDDEN, whole, None, 5, 3, None, inferred=((0.0, 1.0),), width_px=5.0),
    )
    content = written(tmp_path / "labels.json", result_of(LOWER, UPPER, tracks=tracks))

    first, second = content["annotations"]
    assert (first["track_id"], second["track_id"]) == (3, 4)
    assert (decode(first["segmentation"]) == bar((18, 22), (10, 50))).all()
    assert (decode(second["segmentation"]) == bar((38, 42), (10, 20)) | bar((38, 42), (30, 50))).all()


def test_gaps_of_a_detection_stay_out_on_a_track_that_is_longer(tmp_path):
    whole = builders.line((9.75, 40.0), (70.25, 40.0))
    track = Track(4, TrackState.CONFIRMED, whole, None, 5, 0, LOWER, inferred=((0.67, 1.0),))
    content = written(tmp_path / "labels.json", result_of(LOWER, tracks=(track,)))

    mask = decode(content["annotations"][0]["segmentation"])
    assert (mask == bar((38, 42), (10, 20)) | bar((38, 42), (30, 50))).mean() > 0.998


def test_objects_without_a_pixel_are_left_out(tmp_path):
    away = straight((10.0, -40.0), (50.0, -40.0))
    remembered = Track(3, TrackState.CONFIRMED, UPPER.curve, None, 5, 0, UPPER, inferred=((0.0, 1.0),))
    unknown = Track(4, TrackState.CONFIRMED, UPPER.curve, None, 5, 0, None)

    assert written(tmp_path / "a.json", result_of(away))["annotations"] == []
    assert written(tmp_path / "b.json", result_of(UPPER, tracks=(remembered, unknown)))["annotations"] == []


def test_masks_of_a_pipeline_lie_on_the_cable(tmp_path):
    mask = np.zeros((120, 200), np.uint8)
    cv2.ellipse(mask, (100, 130), (80, 90), 0, 200, 340, 255, 9)
    cable = Frame(mask=mask)
    with sinks.open(tmp_path / "labels.json") as sink:
        sink.write(cable, Pipeline().process(cable))

    (label,) = json.loads((tmp_path / "labels.json").read_text())["annotations"]
    drawn = decode(label["segmentation"])
    assert (drawn & (mask > 0)).sum() / (drawn | (mask > 0)).sum() > 0.9
    assert label["track_id"] == 1


def test_a_block_that_fails_leaves_the_labels_so_far(tmp_path):
    def work():
        with sinks.CocoSink(tmp_path / "labels.json") as sink:
            sink.write(frame(), result_of(UPPER))
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        work()
    assert len(json.loads((tmp_path / "labels.json").read_text())["annotations"]) == 1
    assert [path.name for path in tmp_path.iterdir()] == ["labels.json"]


def test_the_older_file_stays_until_the_new_one_is_whole(tmp_path, monkeypatch):
    (tmp_path / "labels.json").write_text("precious")
    sink = sinks.CocoSink(tmp_path / "labels.json")
    sink.write(frame(), result_of(UPPER))
    assert (tmp_path / "labels.json").read_text() == "precious"
    monkeypatch.setattr("os.replace", lambda *_: (_ for _ in ()).throw(OSError(28, "No space left on device")))
    with pytest.raises(SinkError, match=r"labels\.json.*No space"):
        sink.close()
    assert (tmp_path / "labels.json").read_text() == "precious"
    assert [path.name for path in tmp_path.iterdir()] == ["labels.json"]


def test_labelme_gets_a_line_beside_each_picture(tmp_path):
    written(tmp_path / "cable.labelme", result_of(UPPER, LOWER, name="video.mp4#3"), result_of(name="b.jpg", index=5))

    folder = tmp_path / "cable.labelme"
    assert sorted(path.name for path in folder.iterdir()) == [
        "b.json",
        "b.png",
        "video_000003.json",
        "video_000003.png",
    ]
    content = json.loads((folder / "video_000003.json").read_text())
    shapes = content.pop("shapes")
    assert content == {
        **{"version": "5.5.0", "flags": {}, "imagePath": "video_000003.png", "imageData": None},
        **{"imageHeight": 60, "imageWidth": 90},
    }
    assert (cv2.imread(str(folder / "video_000003.png")) == frame().image).all()
    assert shapes[0] == {
        **{"label": "cable", "shape_type": "linestrip", "points": [[9.75, 20.0], [50.25, 20.0]], "group_id": 0},
        **{"description": "width_px=5.0", "flags": {}, "mask": None},
    }
    assert [(one["group_id"], one["points"]) for one in shapes[1:]] == [
        (1, [[9.75, 40.0], [20.28, 40.0]]),
        (1, [[29.59, 40.0], [50.25, 40.0]]),
    ]
    assert json.loads((folder / "b.json").read_text())["shapes"] == []


def test_the_lines_of_labelme_are_read_as_instances(tmp_path):
    written(tmp_path / "cable.labelme", result_of(UPPER, LOWER, name="a.png"))
    labels = read_annotations(tmp_path / "cable.labelme" / "a.json")
    assert np.unique(labels).tolist() == [0, 1, 2]
    for number, (y, parts) in enumerate(((20, [(12, 48)]), (40, [(12, 18), (32, 48)])), 1):
        for start, stop in parts:
            assert (labels[y - 2 : y + 3, start:stop] == number).all()
        assert not (labels[[y - 5, y + 5]]).any()
    assert not labels[40, 24:26].any()


def test_a_line_of_labelme_stays_on_the_curve_with_few_points(tmp_path):
    loop = builders.loop(20.0, (40.0, 30.0))
    points = loop.sample(20)
    round_one = Detection(Centerline((Segment(points, np.full(20, 2.0)),), (), closed=True), loop)
    tracks = (Track(7, TrackState.CONFIRMED, loop, None, 5, 0, round_one),)
    written(tmp_path / "a.labelme", result_of(round_one, tracks=tracks, name="a"))

    (shape,) = json.loads((tmp_path / "a.labelme" / "a.json").read_text())["shapes"]
    line = np.array(shape["points"])
    assert shape["group_id"] == 7
    assert (line[0] == line[-1]).all()
    assert 8 <= len(line) <= 40
    drawn = np.zeros(SIZE, np.uint8)
    cv2.polylines(drawn, [np.rint(line * 16).astype(np.int32)], False, 1, 1, cv2.LINE_8, 4)
    y, x = np.nonzero(drawn)
    assert np.abs(np.hypot(x - 40.0, y - 30.0) - 20.0).max() < 1.5


def test_a_frame_without_an_image_shows_its_mask(tmp_path):
    with sinks.open(f"{tmp_path}/a.labelme/") as sink:
        assert type(sink) is sinks.LabelmeSink
        sink.write(Frame(mask=bar((18, 22), (10, 50)), name="m.png"), result_of(UPPER))
    picture = cv2.imread(str(tmp_path / "a.labelme" / "m.png"), cv2.IMREAD_UNCHANGED)
    assert (picture == 255 * bar((18, 22), (10, 50))).all()


def test_a_mask_that_is_a_probability_is_shown_from_one_half_on(tmp_path):
    cable = bar((18, 22), (10, 50))
    with sinks.open(f"{tmp_path}/a.labelme/") as sink:
        sink.write(Frame(mask=np.where(cable, 0.9, 0.02), name="m.png"), result_of(UPPER))
    picture = cv2.imread(str(tmp_path / "a.labelme" / "m.png"), cv2.IMREAD_UNCHANGED)
    assert (picture == 255 * cable).all()


def test_a_single_result_is_saved_as_labels_and_replaces_no_picture(tmp_path):
    result = replace(result_of(UPPER, name="a.png"), frame=frame(name="a.png"))
    result.save(tmp_path / "a.json")
    result.save(tmp_path / "a.labelme")
    assert (tmp_path / "a.labelme" / "a.json").exists()

    with pytest.raises(InputError, match="would replace it"):
        result.save(tmp_path / "a.labelme")
