from __future__ import annotations

import csv
from dataclasses import replace

import cv2
import numpy as np
import pytest
import sinks.sink_examples as examples
from builders import curve_through, detection_of, line

import dloftbs
from dloftbs.camera import PinholeCamera
from dloftbs.data.frame import Frame
from dloftbs.data.frame_result import FrameResult
from dloftbs.data.tracks import Track, TrackState
from dloftbs.errors import InputError
from dloftbs.sinks import CsvSink


def table(path):
    with path.open(newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))


def test_detections_with_and_without_metres(tmp_path):
    path = tmp_path / "new" / "Kabel ł 電.csv"
    results = [examples.detected(3, 1, in_space=True), examples.nothing(4), examples.detected(5)]
    with CsvSink(path, samples=11) as sink:
        for result in results:
            sink.write(examples.frame(), result)
    rows = table(path)
    assert [row["frame"] for row in rows] == ["3"] * 11 + ["5"] * 22
    assert [row["object"] for row in rows] == ["0"] * 22 + ["1"] * 11
    assert [row["i"] for row in rows] == [str(i) for i in range(11)] * 3
    assert float(rows[0]["stamp"]) == 0.1
    assert rows[0]["state"] == ""
    points = np.array([[float(row["x_px"]), float(row["y_px"])] for row in rows[:11]])
    assert points == pytest.approx(results[0].detections[0].curve.sample(11), abs=5.1e-4)
    metres = np.array([[float(row[f"{axis}_m"]) for axis in "xyz"] for row in rows[:11]])
    assert metres == pytest.approx(results[0].detections[0].curve_3d.sample(11), abs=5.1e-7)
    assert {rows[11][name] for name in ("u_3d", "x_m", "y_m", "z_m", "inferred_3d", "tangent_z_3d")} == {""}
    assert [row["u_3d"] for row in rows[:11]] == [row["u"] for row in rows[:11]]  # without a camera, nobody knows
    assert [float(row["u"]) for row in rows[:11]] == pytest.approx(np.linspace(0, 1, 11))
    assert [row["inferred"] for row in rows[:11]] == list("00000100000")  # the gap spans u = 0.45 to 0.55


def test_tracks(tmp_path):
    with CsvSink(tmp_path / "a.csv", samples=2) as sink:
        sink.write(examples.frame(), examples.tracked(1))
    rows = table(tmp_path / "a.csv")
    assert [row["object"] for row in rows] == ["3", "3", "4", "4", "9", "9"]
    assert [row["state"] for row in rows[::2]] == ["confirmed", "tentative", "hidden"]
    assert {row["stamp"] for row in rows} == {""}
    assert [row["inferred"] for row in rows] == ["0", "0", "0", "0", "1", "1"]


def test_parts_that_a_track_remembers_are_inferred_where_they_lie_on_its_own_curve(tmp_path):
    """The detection shows the first half of the cable, and a gap in the middle of that."""
    camera = PinholeCamera(500.0, 500.0, 320.0, 240.0)
    deep, seen = line((-0.2, 0.0, 1.0), (0.2, 0.0, 1.0)), line((-0.2, 0.0, 1.0), (0.0, 0.0, 1.0))
    flat = curve_through(camera.project(deep.sample(200)))
    half = curve_through(camera.project(seen.sample(200)))
    found = replace(detection_of(half, seen), inferred_3d=((0.41, 0.59),), camera=camera)
    track = Track(1, TrackState.CONFIRMED, flat, deep, 5, 0, found, ((0.25, 0.26), (0.5, 1.0)), camera=camera)
    with CsvSink(tmp_path / "a.csv", samples=101) as sink:
        sink.write(Frame(mask=np.zeros((480, 640), bool)), FrameResult((found,), (track,), None, (480, 640)))
    rows = table(tmp_path / "a.csv")
    u = np.array([float(row["u"]) for row in rows])
    assert [row["inferred"] == "1" for row in rows] == (((u > 0.245) & (u < 0.265)) | (u > 0.495)).tolist()
    assert [row["inferred_3d"] == "1" for row in rows] == (((u > 0.205) & (u < 0.295)) | (u > 0.495)).tolist()


def test_a_row_is_one_point_in_the_image_and_in_space(tmp_path):
    camera = PinholeCamera(500.0, 500.0, 320.0, 240.0)
    deep = line((-0.2, 0.0, 0.5), (0.3, 0.1, 1.5))
    flat = curve_through(camera.project(deep.sample(200)))
    found = replace(detection_of(flat, deep), inferred_3d=((0.5, 0.8),), camera=camera)
    with CsvSink(tmp_path / "a.csv") as sink:
        sink.write(Frame(mask=np.zeros((480, 640), bool)), FrameResult((found,), (), None, (480, 640)))
    rows = table(tmp_path / "a.csv")
    pixels, metres = (
        np.array([[float(row[name]) for name in names] for row in rows])
        for names in (("x_px", "y_px"), ("x_m", "y_m", "z_m"))
    )
    assert np.abs(camera.project(metres) - pixels).max() < 0.02
    u = np.array([float(row["u_3d"]) for row in rows])
    assert u[50] < 0.4  # the nearer half of a cable takes up more of the image
    assert [row["inferred_3d"] == "1" for row in rows] == ((u > 0.5) & (u < 0.8)).tolist()
    assert {row["inferred"] for row in rows} == {"0"}
    along = np.array([[float(row[f"tangent_{axis}_3d"]) for axis in "xyz"] for row in rows])
    assert along == pytest.approx(np.tile(deep.tangent(0.5), (100, 1)), abs=1e-5)
    in_image = np.array([[float(row["tangent_x"]), float(row["tangent_y"])] for row in rows])
    assert in_image == pytest.approx(flat.tangent(np.linspace(0.0, 1.0, 100)), abs=1e-6)


def test_a_curve_behind_the_camera_has_its_own_parameters(tmp_path):
    behind = replace(detection_of(line((0, 0), (9, 9)), line((0, 0, -1), (1, 1, 1))), camera=PinholeCamera(9, 9, 9, 9))
    with CsvSink(tmp_path / "a.csv", samples=3) as sink:
        sink.write(examples.frame(), FrameResult((behind,), (), None, (9, 9)))
    assert [row["u_3d"] for row in table(tmp_path / "a.csv")] == ["0.000000", "0.500000", "1.000000"]


def test_a_tilde_is_the_home_folder(tmp_path, monkeypatch):
    monkeypatch.setenv("HOME", str(tmp_path))
    monkeypatch.setenv("USERPROFILE", str(tmp_path))
    with CsvSink("~/new/a.csv", samples=2) as sink:
        sink.write(examples.frame(), examples.detected())
    assert len(table(tmp_path / "new" / "a.csv")) == 4


def test_whole_after_every_frame(tmp_path):
    with CsvSink(tmp_path / "a.csv", samples=5) as sink:
        columns = "frame,stamp,object,state,i,u,x_px,y_px,inferred,u_3d,x_m,y_m,z_m,inferred_3d,"
        columns += "tangent_x,tangent_y,tangent_x_3d,tangent_y_3d,tangent_z_3d,length_px,length_m\n"
        assert (tmp_path / "a.csv").read_text() == columns
        sink.write(examples.frame(), examples.detected())
        assert len(table(tmp_path / "a.csv")) == 10


@pytest.mark.parametrize("samples", [1, 2.5, True, "many"])
def test_samples_out_of_range(tmp_path, samples):
    with pytest.raises(InputError, match="samples"):
        CsvSink(tmp_path / "a.csv", samples=samples)
    assert not (tmp_path / "a.csv").exists()


def test_branches_have_columns_on_request(tmp_path):
    mask = np.zeros((240, 320), np.uint8)
    for start, stop in (((20, 120), (300, 120)), ((150, 120), (210, 20))):
        cv2.line(mask, start, stop, 255, 10)
    result = dloftbs.detect(mask, branched=True)
    with CsvSink(tmp_path / "a.csv", samples=2, branches=True) as sink:
        sink.write(Frame(mask=mask), result)
        sink.write(Frame(mask=mask), dloftbs.detect(mask))
    rows = table(tmp_path / "a.csv")
    (harness,) = result.harnesses
    branched, plain = rows[: 2 * len(result)], rows[2 * len(result) :]
    assert [row["harness"] for row in branched] == ["0"] * 2 * len(result)
    assert [int(row["branch"]) for row in branched[::2]] == [harness.branches.index(k) for k in range(len(result))]
    assert {row["harness"] + row["branch"] for row in plain} == {""}
    assert all(None not in row and None not in row.values() for row in rows)
