from __future__ import annotations

import shutil
import zipfile

import numpy as np
import pytest
import sinks.sink_examples as examples

import dloftbs
from dloftbs.data.curve import BSplineCurve
from dloftbs.data.frame_result import FrameResult
from dloftbs.errors import SinkError, SourceError
from dloftbs.sinks import NpzSink, npz_curves, read_npz


def write(path, results):
    with NpzSink(path) as sink:
        for result in results:
            sink.write(examples.frame(), result)


def test_the_arrays_as_promised(tmp_path):
    results = [examples.detected(0, in_space=True), examples.nothing(1), examples.detected(2)]
    path = tmp_path / "new" / "Kabel ł 電.npz"
    write(path, results)
    with np.load(path) as file:
        arrays = dict(file)
    assert arrays["frame"].tolist() == [0, 0, 2, 2]
    assert arrays["track_id"].tolist() == [0] * 4
    assert arrays["detection"].tolist() == [0, 1, 0, 1]
    assert arrays["stamp"].tolist() == [0.0, 0.0, 2 / 30, 2 / 30]
    assert arrays["state"].tolist() == [""] * 4
    assert arrays["n_control"].tolist() == [6, 7, 6, 7]
    assert arrays["degree"].tolist() == [3] * 4
    assert arrays["closed"].dtype == np.bool_
    assert arrays["width_px"].tolist() == [5.0] * 4
    assert arrays["confidence"].tolist() == [0.75] * 4
    assert arrays["offsets"].tolist() == [0, 6, 13, 19, 26]
    assert arrays["offsets_3d"].tolist() == [0, 9, 19, 19, 19]
    assert arrays["control_points"].shape == (26, 2)
    assert arrays["control_points_3d"].shape == (19, 3)
    assert arrays["knots"].shape == (arrays["knot_offsets"][-1],)
    expected = results[2].detections[1].curve
    assert np.array_equal(arrays["control_points"][19:26], expected.control_points)
    assert np.array_equal(arrays["knots"][slice(*arrays["knot_offsets"][3:5])], expected.knots)


def test_detections_come_back_as_curves(tmp_path):
    result = examples.detected(4, in_space=True)
    write(tmp_path / "a.npz", [result])
    for number, (row, detection) in enumerate(zip(read_npz(tmp_path / "a.npz"), result.detections, strict=True)):
        assert (row.frame, row.stamp, row.track_id, row.state) == (4, 4 / 30, None, None)
        assert (row.detection, row.width_px, row.confidence) == (number, 5.0, 0.75)
        assert row.curve == detection.curve
        assert row.curve_3d == detection.curve_3d


def test_tracks_come_back_with_their_detections(tmp_path):
    result = examples.tracked(4)
    write(tmp_path / "a.npz", [result])
    rows = read_npz(tmp_path / "a.npz")
    assert [row.track_id for row in rows] == [3, 4, 9]
    assert [row.detection for row in rows] == [1, 0, None]
    assert [row.state for row in rows] == ["confirmed", "tentative", "hidden"]
    assert [row.width_px for row in rows] == [5.0, 5.0, None]
    assert [row.stamp for row in rows] == [None] * 3
    assert [row.curve for row in rows] == [track.curve for track in result.tracks]
    assert [row.curve_3d for row in rows] == [track.curve_3d for track in result.tracks]


def test_a_closed_curve_of_another_degree(tmp_path):
    closed = BSplineCurve(np.linspace(-0.5, 1.5, 9), np.ones((6, 2)), 2, closed=True)
    detection = examples.detection()
    write(tmp_path / "a.npz", [FrameResult((type(detection)(detection.centerline, closed),), (), None, (48, 64))])
    assert read_npz(tmp_path / "a.npz")[0].curve == closed


def test_without_any_object_the_arrays_are_empty(tmp_path):
    write(tmp_path / "a.npz", [examples.nothing()])
    assert read_npz(tmp_path / "a.npz") == []
    with np.load(tmp_path / "a.npz") as arrays:
        assert arrays["control_points"].shape == (0, 2)
        assert arrays["offsets"].tolist() == [0]


def test_nothing_is_written_before_closing(tmp_path):
    older, path = [examples.detected(7)], tmp_path / "a.npz"
    write(path, older)
    with NpzSink(path) as sink:
        sink.write(examples.frame(), examples.detected(8))
        assert [row.frame for row in read_npz(path)] == [7, 7]
    assert [row.frame for row in read_npz(path)] == [8, 8]
    assert [child.name for child in tmp_path.iterdir()] == ["a.npz"]


def test_a_long_stream_is_whole_for_other_readers_of_zip_files(tmp_path):
    results = [examples.detected(i, in_space=i >= 200) for i in range(300)]
    write(tmp_path / "a.npz", results)
    rows = read_npz(tmp_path / "a.npz")
    assert len(rows) == 600
    assert rows[599].curve_3d == results[299].detections[1].curve_3d
    with zipfile.ZipFile(tmp_path / "a.npz") as archive:
        assert archive.testzip() is None


@pytest.mark.parametrize("error", [KeyboardInterrupt, RuntimeError])
def test_what_ends_the_block_leaves_the_frames_before_it(tmp_path, error):
    def work():
        with NpzSink(tmp_path / "a.npz") as sink:
            for i in range(3):
                sink.write(examples.frame(), examples.detected(i))
            raise error

    with pytest.raises(error):
        work()
    assert [row.frame for row in read_npz(tmp_path / "a.npz")] == [0, 0, 1, 1, 2, 2]


def test_ctrl_c_in_the_middle_of_a_frame_leaves_that_frame_out(tmp_path, monkeypatch):
    real = npz_curves.object_rows

    def interrupted(result):
        yield next(real(result))
        raise KeyboardInterrupt

    with NpzSink(tmp_path / "a.npz") as sink:
        sink.write(examples.frame(), examples.detected(0))
        with monkeypatch.context() as patch:
            patch.setattr(npz_curves, "object_rows", interrupted)
            with pytest.raises(KeyboardInterrupt):
                sink.write(examples.frame(), examples.detected(1, in_space=True))
        sink.write(examples.frame(), examples.detected(2))
    assert [row.frame for row in read_npz(tmp_path / "a.npz")] == [0, 0, 2, 2]


def test_what_is_no_such_file_is_a_source_error(tmp_path):
    (tmp_path / "text.npz").write_text("no zip")
    (tmp_path / "empty.npz").write_bytes(b"")
    np.savez(tmp_path / "other.npz", a=np.zeros(3))
    write(tmp_path / "spoilt.npz", [examples.detected()])
    with np.load(tmp_path / "spoilt.npz") as arrays:
        spoilt = dict(arrays) | {"knots": np.zeros(3)}
    np.savez(tmp_path / "spoilt.npz", **spoilt)
    np.save(tmp_path / "array.npy", np.zeros(3))
    (tmp_path / "array.npy").rename(tmp_path / "array.npz")
    for name in ("none", "text", "empty", "other", "spoilt", "array"):
        with pytest.raises(SourceError, match=name):
            read_npz(tmp_path / f"{name}.npz")


def test_a_file_that_vanished_is_a_sink_error(tmp_path):
    sink = NpzSink(tmp_path / "a" / "a.npz")
    sink.write(examples.frame(), examples.detected())
    shutil.rmtree(tmp_path / "a")
    with pytest.raises(SinkError, match=r"a\.npz"):
        sink.close()
    sink.close()


def test_branch_points_have_arrays_of_their_own(tmp_path):
    mask = np.zeros((120, 200), np.uint8)
    mask[56:64, 10:190] = mask[60:110, 96:104] = 1
    branched = dloftbs.detect(mask, branched=True)
    path = tmp_path / "a.npz"
    write(path, [examples.nothing(0), branched])
    (point,) = branched.branch_points
    with np.load(path) as file:
        arrays = dict(file)
    assert arrays["harness"].tolist() == [0] * 3
    assert arrays["branch_point"].tolist() == [list(point.position)]
    assert np.isnan(arrays["branch_point_3d"]).all()
    assert arrays["branch_point_members"].tolist() == [list(end) for end in point.members]
    assert arrays["branch_point_offsets"].tolist() == [0, 3]
    assert arrays["branch_point_id"].tolist() == [0]
    assert arrays["branch_point_confidence"].tolist() == [point.confidence]
    assert [row.detection for row in read_npz(path)] == [0, 1, 2]
    write(path, [examples.detected(0)])
    with np.load(path) as file:
        assert not any(name.startswith(("branch", "harness")) for name in file)
