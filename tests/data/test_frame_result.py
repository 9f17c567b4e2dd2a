"""Output of the pipeline: its checks and plain values."""

from __future__ import annotations

import contextlib
import math
import pickle
import sys
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import cv2
import numpy as np
import pytest
from builders import detection_of, line, loop, through_json, wave

from dloftbs import Frame, PinholeCamera, Pipeline, detect, sinks, viz
from dloftbs.data.centerline import Joint, JointKind
from dloftbs.data.detection import Crossing
from dloftbs.data.dropped import Dropped
from dloftbs.data.frame_result import FrameResult
from dloftbs.data.tracks import EndKind, Track, TrackState
from dloftbs.errors import InputError, SinkError

SIZE = (240, 320)
CAMERA = PinholeCamera(300.0, 300.0, 159.5, 119.5)


def drawn(*lines: list[tuple[int, int]]) -> np.ndarray:
    mask = np.zeros(SIZE, np.uint8)
    cv2.polylines(mask, [np.array(points, np.int32) for points in lines], False, 255, 9)
    return mask


CROSSED = drawn([(20, 60), (300, 180)], [(20, 180), (300, 60)], [(20, 220), (300, 225)])
BROKEN = CROSSED * (np.arange(320) // 6 != 10).astype(np.uint8)


def tracked() -> FrameResult:
    """Return what a pipeline makes of crossing cables with a gap, in metres, once their tracks are confirmed."""
    pipeline, depth = Pipeline(), np.full(SIZE, 0.8)
    for index in range(5):
        frame = Frame(mask=BROKEN, depth=depth, camera=CAMERA, index=index, stamp=index / 30, name=f"{index}.png")
        result = pipeline.process(frame)
    return result


def by_hand() -> FrameResult:
    """Return a loop, an object that was dropped, and a track that runs against its detection, with a part of it."""
    joint = Joint(JointKind.CROSSING, (0.2, 0.3), 1.0, math.inf, 0.3, ((4.0, 5.0), None))
    first, second = detection_of(loop(40.0, (99.0, 99.0))), detection_of(wave(), line((0, 0, 1), (0, 1, 2)), (joint,))
    second = replace(second, inferred_3d=((0.1, 0.3),))
    shown = Track(5, TrackState.CONFIRMED, wave((1.0, 2.0)), None, 3, 0, second.reversed(), ((0.1, 0.25),), 0.7, 6.1)
    hidden = Track(7, TrackState.HIDDEN, wave(), None, 9, 2, None, ends=(EndKind.FREE, EndKind.HIDDEN))
    dropped = Dropped(detection_of(line((0, 0), (7, 9))).centerline, "it is a speck", 0.2)
    return FrameResult(
        (first, second), (shown, hidden), None, SIZE, {"fitting": 0.25}, 3, None, "x", dropped=(dropped,)
    )


class TestFrameResult:
    def test_the_dictionary_is_strict_json(self):
        detection = detection_of(wave())
        track = Track(1, TrackState.TENTATIVE, detection.curve, None, 1, 0, detection)
        stage_ms = {"cleaning": 0.5, "fitting": 0.25}
        result = FrameResult((detection,), (track,), None, (480, 640), stage_ms, 7, 0.2, "a.png")
        data = through_json(result.to_dict())
        assert data["detections"] == [through_json(detection.to_dict())]
        assert data["tracks"] == [{**through_json(track.to_dict()), "detection": 0, "reversed": False}]
        assert (data["index"], data["stamp"], data["name"], data["size"]) == (7, 0.2, "a.png", [480, 640])
        assert data["stage_ms"] == stage_ms
        assert result.total_ms == 0.75

    def test_as_a_sequence_it_is_its_detections(self):
        both = detection_of(wave()), detection_of(wave()).reversed()
        result = FrameResult(both, (), None, (4, 6))
        assert (len(result), list(result), result[0], result[-1], result[:1]) == (2, list(both), *both, both[:1])
        assert result
        assert not FrameResult((), (), "the mask is empty", (4, 6))
        with pytest.raises(IndexError):
            result[2]

    def test_crossings_are_among_what_was_found(self):
        crossing = Crossing((10.5, 20.0), ((0, 0.25), (0, 0.75)), 1, 0.5)
        result = FrameResult((detection_of(wave()),), (), None, (4, 6), crossings=(crossing,))
        assert through_json(result.to_dict())["crossings"] == [through_json(crossing.to_dict())]
        assert FrameResult((), (), None, (4, 6)).to_dict()["crossings"] == []

    def test_nothing_is_a_result_with_a_reason(self):
        result = FrameResult((), (), "the mask is empty", (4, 6))
        data = through_json(result.to_dict())
        assert (data["detections"], data["tracks"], data["reason"]) == ([], [], "the mask is empty")
        assert (data["stage_ms"], result.total_ms) == ({}, 0)

    def test_the_default_of_the_stage_times_is_shared_by_no_two_results(self):
        first, second = (FrameResult((), (), None, (4, 6)) for _ in range(2))
        assert first.stage_ms == second.stage_ms == {}
        assert first.stage_ms is not second.stage_ms

    def test_results_can_go_to_another_process(self):
        detection = detection_of(wave())
        result = FrameResult((detection,), (), None, (4, 6), {"cleaning": 0.5})
        again = pickle.loads(pickle.dumps(result))
        assert again.detections[0].curve == detection.curve
        assert again.to_dict() == result.to_dict()

    @pytest.mark.parametrize(
        ("name", "value"),
        [
            ("detections", (1,)),
            ("tracks", None),
            ("reason", 5),
            *(("size", value) for value in ((4,), (4.0, 6), None, (-1, 6), (10**400, 6))),
            *(("stage_ms", value) for value in (None, {"a": "b"}, {1: 2.0}, {"a": math.nan})),
            *(("index", value) for value in (-1, 1.0)),
            *(("stamp", value) for value in (math.nan, "1", 10**400)),
            ("name", None),
            ("crossings", (None,)),
        ],
    )
    def test_wrong_fields_are_refused(self, name, value):
        with pytest.raises(InputError, match=f"{name} must"):
            replace(FrameResult((), (), None, (4, 6)), **{name: value})


RESULTS = [tracked, by_hand, lambda: detect(CROSSED, objects=2), lambda: detect(np.zeros(SIZE, np.uint8))]


class TestFromDict:
    @pytest.mark.parametrize("make", RESULTS)
    def test_nothing_of_the_dictionary_is_lost(self, make):
        result = make()
        data = through_json(result.to_dict())
        back = FrameResult.from_dict(data)
        assert through_json(back.to_dict()) == data
        assert len(back) == len(result)
        assert [d.inferred for d in back] == [d.inferred for d in result]

    def test_a_track_has_its_detection_in_its_direction(self):
        (shown, hidden) = FrameResult.from_dict(through_json(by_hand().to_dict())).tracks
        assert shown.detection.curve == wave().reversed()
        assert shown.detection.joints[0].alternatives == (None, (4.0, 5.0))
        assert (hidden.detection, hidden.ends) == (None, (EndKind.FREE, EndKind.HIDDEN))

    def test_a_centre_line_lies_on_its_curve_and_breaks_at_its_joints(self):
        (_, back) = FrameResult.from_dict(through_json(by_hand().to_dict()))
        first, second = back.centerline.segments
        np.testing.assert_allclose(first.points[[0, -1]], wave()([0.0, back.joints[0].u[0]]), atol=1e-9)
        np.testing.assert_allclose(second.points[[0, -1]], wave()([back.joints[0].u[1], 1.0]), atol=1e-9)
        assert np.linalg.norm(np.diff(first.points, axis=0), axis=1).max() <= 1.0 + 1e-9
        assert (back.width_px, back.confidence) == (6.0, by_hand()[1].confidence)

    def test_a_line_of_the_file_comes_back(self, tmp_path: Path):
        with sinks.open(tmp_path / "a.jsonl") as sink:
            sink.write(Frame(mask=BROKEN), tracked())
        (row,) = sinks.read_json_lines(tmp_path / "a.jsonl")
        assert FrameResult.from_dict(row).tracks[0].curve == tracked().tracks[0].curve

    def test_it_is_drawn_alike(self):
        result = tracked()
        back = FrameResult.from_dict(through_json(result.to_dict()))
        np.testing.assert_array_equal(viz.draw(BROKEN, back), viz.draw(BROKEN, result))

    @pytest.mark.parametrize("key", list(FrameResult((), (), None, SIZE).to_dict()))
    def test_a_missing_key_is_named(self, key):
        data = by_hand().to_dict()
        del data[key]
        with pytest.raises(InputError, match=f"a result needs the key '{key}', got"):
            FrameResult.from_dict(data)

    @pytest.mark.parametrize("value", [None, 5, "x", [], [5]])
    def test_what_is_no_dictionary_is_refused(self, value):
        with pytest.raises(InputError, match="a result needs a dictionary as of to_dict, got"):
            FrameResult.from_dict(value)

    @pytest.mark.parametrize("value", [5, "x", {}, [5], [None], [[]], [{}], math.nan])
    @pytest.mark.parametrize("key", ["detections", "crossings", "dropped", "tracks", "size", "index"])
    def test_garbage_is_refused(self, key, value):
        if (key, value) == ("index", 5):
            return
        with pytest.raises(InputError):
            FrameResult.from_dict({**by_hand().to_dict(), key: value})

    @pytest.mark.parametrize("value", [None, 5, "x", [], {}, [[]], math.nan, -1, 10**400])
    @pytest.mark.parametrize("rows", ["detections", "crossings", "dropped", "tracks"])
    def test_garbage_within_is_refused_or_a_value(self, rows, value):
        """Whatever stands in the place of a value: it is that value, or an error of ours."""
        data = through_json(tracked().to_dict() | {"dropped": by_hand().to_dict()["dropped"]})
        for key in data[rows][0]:
            with contextlib.suppress(InputError):
                FrameResult.from_dict({**data, rows: [{**data[rows][0], key: value}]})


class TestSave:
    @pytest.mark.parametrize(
        "name", ["a.jsonl", "a.ndjson", "a.npz", "a.csv", "a.ply", "a.obj", "a.usda", "a.xml", "a.png", "a.mp4", "new/"]
    )
    def test_the_name_says_the_kind(self, tmp_path: Path, name: str):
        tracked().save(f"{tmp_path}/{name}")
        place = tmp_path / name
        assert any(place.iterdir()) if name.endswith("/") else place.stat().st_size > 0

    def test_a_line_of_json_is_the_result(self, tmp_path: Path):
        tracked().save(tmp_path / "a.jsonl")
        (row,) = sinks.read_json_lines(tmp_path / "a.jsonl")
        assert row["index"] == 4
        assert FrameResult.from_dict(row).to_dict() == row

    def test_a_picture_is_drawn_on_the_frame(self, tmp_path: Path):
        image = np.full((*SIZE, 3), 90, np.uint8)
        detect(CROSSED, image=image).save(tmp_path / "kept.png")
        tracked().save(tmp_path / "given.png", Frame(image=image))
        tracked().save(tmp_path / "without.png")
        kept, given, without = (cv2.imread(str(tmp_path / f"{n}.png"))[-1, -1, 0] for n in ("kept", "given", "without"))
        assert kept == given == 90 != without

    def test_the_frame_is_not_replaced(self, tmp_path: Path):
        """A frame knows the name of its file, not the folder."""
        for name in ("photo.png", "photo.jpg"):
            (tmp_path / name).write_bytes(b"the photograph")
        found = Pipeline().process(Frame(mask=CROSSED, name="photo.png"))
        for path in (tmp_path / "photo.png", f"{tmp_path}/"):
            with pytest.raises(InputError, match="has the name of the frame and would replace it; choose another name"):
                found.save(path)
        found.save(tmp_path / "photo.jpg")
        assert (tmp_path / "photo.png").read_bytes() == b"the photograph"
        found.save(tmp_path / "other" / "photo.png")

    def test_a_kind_that_nobody_knows_is_named(self, tmp_path: Path):
        with pytest.raises(InputError, match="unknown kind of result"):
            tracked().save(tmp_path / "a.xyz")
        with pytest.raises(SinkError, match="no object in the frame has a curve in space"):
            detect(CROSSED).save(tmp_path / "a.ply")


class Table(SimpleNamespace):
    """What a table is made from, in the place of pandas."""

    def __init__(self, columns: dict[str, np.ndarray]) -> None:
        super().__init__(columns=columns)


class TestTable:
    @pytest.fixture
    def table_of(self, monkeypatch: pytest.MonkeyPatch):
        monkeypatch.setitem(sys.modules, "pandas", SimpleNamespace(DataFrame=Table))
        return lambda result, **how: result.to_dataframe(**how).columns

    def test_a_row_is_a_point(self, table_of):
        result = tracked()
        columns = table_of(result, samples=7)
        assert {len(values) for values in columns.values()} == {7 * len(result.tracks)}
        for number, track in enumerate(result.tracks):
            rows = slice(7 * number, 7 * number + 7)
            points = np.stack((columns["x_px"][rows], columns["y_px"][rows]), axis=1)
            np.testing.assert_array_equal(points, track.curve.sample(7))
            assert set(columns["object"][rows].tolist()) == {track.id}
        assert set(columns["state"].tolist()) == {"confirmed"}
        assert set(columns["stamp"].tolist()) == {4 / 30}
        assert np.isfinite(columns["z_m"]).all()

    def test_its_columns_are_those_of_the_file(self, table_of, tmp_path: Path):
        for name, result in (("a", tracked()), ("b", by_hand()), ("c", RESULTS[-1]())):
            result.save(tmp_path / f"{name}.csv")
            head, *rows = (tmp_path / f"{name}.csv").read_text().splitlines()
            columns = table_of(result)
            assert list(columns) == head.split(",")
            assert len(columns["u"]) == len(rows)

    def test_what_is_not_there_is_not_a_number(self, table_of):
        columns = table_of(detect(CROSSED))
        assert np.isnan(columns["stamp"]).all()
        assert np.isnan(columns["x_m"]).all()
        assert set(columns["state"].tolist()) == {""}

    def test_without_pandas_it_says_how_to_get_it(self, monkeypatch: pytest.MonkeyPatch):
        monkeypatch.setitem(sys.modules, "pandas", None)
        with pytest.raises(InputError, match="a table needs pandas: pip install pandas"):
            by_hand().to_dataframe()

    @pytest.mark.parametrize("samples", [1, 2.5, True, "many"])
    def test_samples_out_of_range(self, samples):
        with pytest.raises(InputError, match="samples"):
            by_hand().to_dataframe(samples)
