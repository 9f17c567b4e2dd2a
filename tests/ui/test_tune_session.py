from __future__ import annotations

import time
from contextlib import contextmanager
from threading import Event

import numpy as np
import pytest
from drawings import wave
from ui.page_client import SIZE, CableSource, cable_mask, connected, mask_of

from dloftbs import Config, Frame, HsvRange, PinholeCamera, Pipeline
from dloftbs.config import SegmentationConfig
from dloftbs.errors import ConfigError
from dloftbs.support import documents
from dloftbs.ui import tune_session
from dloftbs.ui.frame_store import FrameStore
from dloftbs.ui.server import serve
from dloftbs.ui.tune_document import DrawnStroke, TuneDocument
from dloftbs.ui.tune_segmentation import Translator
from dloftbs.ui.tune_session import TuneSession

COMMAND = "dloftbs track cable.mp4 --config cable.yaml"


@contextmanager
def tuning(source=None, config=None, target=None):
    session = TuneSession(FrameStore(source or CableSource(12)), config or Config(), target, COMMAND)
    with serve(session, port=0) as address, connected(address) as client:
        yield client, address


def along(shift=0.0, count=20):
    """Points along the cable, as a hand draws them: a pixel off now and then."""
    points = wave(SIZE, 1.0, shift)[:: max(1, len(wave(SIZE, 1.0, shift)) // count)]
    jitter = np.random.default_rng(1).uniform(-1.0, 1.0, points.shape)
    return np.round(points + jitter, 1).tolist()


def draw(client, frame=0, *, cable=True, done=True, points=None):
    points = along(0.03 * frame) if points is None else points
    client.send(type="draw", frame=frame, points=points, cable=cable, radius_px=2.0, done=done)


def overlap(parts, frame):
    found, true = mask_of(parts), cable_mask(0.03 * frame)
    return (found & true).sum() / (found | true).sum()


def test_a_stroke_makes_the_mask_while_it_is_drawn_and_undo_takes_it_back():
    with tuning() as (client, _):
        assert client.text("state")["strokes"] == []
        assert client.picture()[0]["suggested"]
        draw(client, done=False)
        header, parts = client.picture(lambda header: not header["suggested"])
        assert overlap(parts, 0) > 0.8
        assert "image" not in parts  # the browser has it
        assert len(header["curves"]) == 1
        draw(client)
        state = client.text("state", lambda state: state["strokes"])
        assert (state["can_undo"], state["saved"], state["method"]) == (True, False, "strokes")
        client.send(type="undo")
        assert client.picture(lambda header: header["suggested"])
        client.send(type="redo")
        assert overlap(client.picture(lambda header: not header["suggested"])[1], 0) > 0.8
        client.send(type="clear")
        assert client.picture(lambda header: header["suggested"])


@pytest.mark.parametrize("message", [{"type": "seek", "index": 0}, {"type": "undo"}, {"type": "redo"}])
def test_a_draft_ends_with_what_follows(message):
    with tuning() as (client, _):
        draw(client, done=False)
        client.picture(lambda header: not header["suggested"])
        client.send(**message)
        assert client.picture(lambda header: header["suggested"])


def test_a_draft_ends_with_the_guess():
    with tuning() as (client, _):
        draw(client, done=False, points=[[5, 5], [60, 5]])
        assert overlap(client.picture(lambda header: not header["suggested"])[1], 0) < 0.5
        client.send(type="accept", frame=0)
        while overlap(client.picture()[1], 0) < 0.8:
            pass


def test_frames_can_be_looked_at_in_any_order():
    with tuning() as (client, _):
        client.picture()
        for index in (7, 3, 11):
            client.send(type="seek", index=index)
            _header, parts = client.picture(lambda header, index=index: header["index"] == index)
            assert "image" in parts
        client.send(type="seek", index=None)
        assert client.text("error")["message"] == "only a camera has a newest frame"


def test_the_strip_counts_the_objects_of_all_frames():
    with tuning() as (client, _):
        draw(client)
        strip = client.text("strip", lambda strip: strip["done"] and strip["objects"])
        assert strip["objects"] == [[index, 1] for index in range(12)]
        assert (strip["length"], strip["warnings"]) == (12, [])


def test_what_is_saved_is_what_the_pipeline_does(tmp_path):
    target = tmp_path / "cable.yaml"
    with tuning(target=target) as (client, _):
        draw(client)
        shown = mask_of(client.picture(lambda header: not header["suggested"])[1])
        client.send(type="save")
        saved = client.text("saved")
        assert saved["command"] == COMMAND
        assert client.text("state", lambda state: state["strokes"] and state["saved"])
    assert target.read_text() == saved["text"]
    config = Config.from_file(target)
    frame = CableSource().frame(0)
    assert np.array_equal(Pipeline(config).trace(frame).mask, shown)
    assert [path.name for path in tmp_path.iterdir()] == ["cable.yaml"]


def test_tuning_goes_on_where_it_was_saved(tmp_path):
    with tuning(target=tmp_path / "a.yaml") as (client, _):
        draw(client)
        draw(client, 4, cable=False, points=[[5, 5], [60, 5]])
        client.text("state", lambda state: len(state["strokes"]) == 2)
        client.send(type="save")
        text = client.text("saved")["text"]
    config = Config.from_file(tmp_path / "a.yaml")
    with tuning(config=config, target=tmp_path / "b.yaml") as (client, _):
        strokes = client.text("state")["strokes"]
        assert [(stroke["frame"], stroke["cable"]) for stroke in strokes] == [(0, True), (4, False)]
        assert not client.picture()[0]["suggested"]
        client.send(type="save")
        assert client.text("saved")["text"] == text
    other = CableSource(3)
    other.name = "other.mp4"
    with tuning(other, config=config) as (client, _):  # strokes on another picture count, and are kept
        state = client.text("state")
        assert (state["strokes"], state["others"]) == ([], 2)
        assert not client.picture()[0]["suggested"]
        client.send(type="save")
        assert Config.from_yaml(client.text("saved")["text"]).segmentation == config.segmentation


@pytest.mark.parametrize("live", [False, True])
def test_saved_colours_are_kept_on_another_video_of_the_same_name(tmp_path, live):
    with tuning(target=tmp_path / "a.yaml") as (client, _):
        draw(client)
        client.send(type="save")
        client.text("saved")

    class Other(CableSource):
        def frame(self, index):
            return Frame(image=np.full((*SIZE, 3), 200, np.uint8), index=index)

    config = Config.from_file(tmp_path / "a.yaml")
    with tuning(Other(12, live=live), config=config) as (client, _):
        state = client.text("state")
        assert (len(state["strokes"]), state["others"]) == ((0, 1) if live else (1, 0))
        client.send(type="save")
        assert Config.from_yaml(client.text("saved")["text"]).segmentation == config.segmentation


def test_without_a_stroke_nothing_is_saved_and_without_a_file_the_text_is_shown(tmp_path):
    with tuning(target=tmp_path / "cable.yaml") as (client, _):
        client.send(type="save")
        assert "draw a stroke" in client.text("error")["message"]
    assert list(tmp_path.iterdir()) == []
    with tuning() as (client, _):
        assert client.text("state")["target"] is None
        draw(client)
        client.send(type="save")
        assert Config.from_yaml(client.text("saved")["text"]).segmentation.colour is not None


def test_a_file_that_cannot_be_written_is_told(tmp_path):
    (tmp_path / "folder.yaml").mkdir()
    with tuning(target=tmp_path / "folder.yaml") as (client, _):
        draw(client)
        client.send(type="save")
        assert client.text("error")["kind"] == "SinkError"


def test_a_file_that_could_not_be_read_again_does_not_replace_the_last_one(tmp_path, monkeypatch):
    target = tmp_path / "cable.yaml"
    with tuning(target=target) as (client, _):
        draw(client)
        client.send(type="save")
        before = client.text("saved")["text"]
        monkeypatch.setattr(documents, "MAX_BYTES", len(before))
        draw(client, frame=3)
        client.send(type="save")
        assert "strokes on fewer frames" in client.text("error")["message"]
    assert target.read_text() == before


def test_the_guess_is_taken_over_as_strokes():
    with tuning() as (client, _):
        assert client.picture()[0]["curves"]
        client.send(type="accept", frame=0)
        state = client.text("state", lambda state: state["strokes"])
        assert all(stroke["cable"] for stroke in state["strokes"])
        _header, parts = client.picture(lambda header: not header["suggested"])
        assert overlap(parts, 0) > 0.8


def test_ranges_follow_the_sliders_and_are_warned_of_where_too_wide():
    config = Config(segmentation=SegmentationConfig(hsv=(HsvRange.parse("100:110"),)))
    with tuning(config=config) as (client, _):
        state = client.text("state")
        assert (state["method"], state["ranges"]) == ("ranges", [[100, 110, 40, 255, 40, 255]])
        assert client.picture()[0]["reason"] == "the mask is empty"
        client.send(type="ranges", ranges=[[5, 20, 80, 255, 60, 255]], done=False)
        assert overlap(client.picture(lambda header: header["curves"])[1], 0) > 0.9
        client.send(type="ranges", ranges=[[0, 179, 0, 255, 0, 255]], done=True)
        header, _ = client.picture(lambda header: header["doubt"])
        assert header["doubt"].startswith("100 % of the mask is set")
        assert client.text("strip", lambda strip: strip["warnings"])["warnings"][0].startswith("100 % of the mask")


def test_two_browsers_share_the_document_and_each_has_its_frame():
    with tuning() as (one, address), connected(address) as two:
        two.send(type="seek", index=5)
        assert two.picture(lambda header: header["index"] == 5)
        draw(one)
        assert one.picture(lambda header: not header["suggested"])[0]["index"] == 0
        header, parts = two.picture(lambda header: not header["suggested"])
        assert header["index"] == 5
        assert overlap(parts, 5) > 0.8
        assert two.text("state", lambda state: state["strokes"])["strokes"][0]["frame"] == 0


@pytest.mark.parametrize("points", [[[-50, -50], [-20, -30]], [[5000, 5000]]])
def test_strokes_beside_the_image_are_no_error(points):
    with tuning() as (client, _):
        draw(client)
        client.picture(lambda header: not header["suggested"])
        draw(client, points=points)
        state = client.text("state", lambda state: len(state["strokes"]) == 2)
        assert client.picture()[0]["curves"]
        assert state["can_undo"]


def test_a_stroke_that_lies_wholly_beside_the_image_says_nothing():
    with tuning() as (client, _):
        client.picture()
        draw(client, points=[[-50, -50]])
        assert "draw a stroke" in client.text("error")["message"]


def test_what_stands_above_the_ground_is_cable_where_there_is_depth():
    camera = PinholeCamera(150.0, 150.0, 99.5, 59.5)
    depth = np.where(cable_mask(0.0), 0.49, 0.5)

    class DepthSource(CableSource):
        def frame(self, index):
            return Frame(image=np.full((*SIZE, 3), 90, np.uint8), depth=depth, camera=camera, index=index)

    with tuning(DepthSource(3)) as (client, _):
        assert client.picture()[0]["has_depth"]
        client.send(type="height", height_m=0.004, join="and", done=True)
        header, parts = client.picture(lambda header: not header["suggested"])
        assert overlap(parts, 0) > 0.9
        assert header["curves"][0]["space"]


def test_a_camera_is_followed_until_somebody_looks_at_a_frame():
    with tuning(CableSource(30, live=True)) as (client, _):
        assert client.text("state")["live"]
        _newest, _ = client.picture(lambda header: header["index"] == 29)
        client.send(type="seek", index=3)
        assert client.picture(lambda header: header["index"] == 3)
        draw(client, 3)
        assert client.picture(lambda header: not header["suggested"])[0]["index"] == 3
        client.send(type="seek", index=None)
        assert client.picture(lambda header: header["index"] == 29)


def test_strokes_on_a_camera_stay_on_the_picture_they_were_drawn_on():
    go_on = Event()

    class Camera(CableSource):
        def frame(self, index):
            if index == 2:
                go_on.wait(20.0)
            time.sleep(0.02)
            if index > 1:
                return Frame(image=np.full((*SIZE, 3), 200, np.uint8), index=index)
            return super().frame(index)

    store = FrameStore(Camera(80, live=True), budget_bytes=4 * 3 * SIZE[0] * SIZE[1])
    session = TuneSession(store, Config(), None, COMMAND)
    with serve(session, port=0) as address, connected(address) as client:
        client.picture(lambda header: header["index"] == 1)
        draw(client, 1)
        client.send(type="save")
        text = client.text("saved")["text"]
        go_on.set()
        client.picture(lambda header: header["index"] == 79)
        client.send(type="seek", index=1)
        client.picture(lambda header: header["index"] == 1)
        client.send(type="accept", frame=41)
        assert "frame 41 is no longer kept" in client.text("error")["message"]
        client.send(type="region", box=[0, 0, SIZE[1], SIZE[0]])  # has the colours counted anew
        client.text("state", lambda state: state["roi"])
        client.send(type="save")
        again = client.text("saved")["text"]
    one, other = (Config.from_yaml(each).segmentation for each in (text, again))
    assert one == other


def test_masks_have_nothing_to_tune():
    class MaskSource(CableSource):
        def frame(self, index):
            return Frame(mask=cable_mask(0.0), index=index)

    with tuning(MaskSource(3)) as (client, _):
        header, _ = client.picture()
        assert not header["suggested"]
        client.send(type="accept", frame=0)
        assert "masks already" in client.text("error")["message"]


@pytest.mark.parametrize(("kind", "scale"), [(np.float32, 1.0), (np.uint8, 255.0)])
def test_of_a_probability_one_half_and_more_is_shown_and_doubted(kind, scale):
    class SoftSource(CableSource):
        def frame(self, index):
            probability = np.where(cable_mask(0.0), 0.97, 0.02)  # as networks give it: nowhere 0
            return Frame(mask=(scale * probability).astype(kind), index=index, mask_is="probability")

    with tuning(SoftSource(3)) as (client, _):
        header, parts = client.picture()
        assert np.array_equal(mask_of(parts), cable_mask(0.0))
        assert (header["doubt"], len(header["curves"])) == (None, 1)


def test_messages_of_the_other_page_are_refused():
    with tuning() as (client, _):
        client.send(type="pause", paused=True)
        assert "does not take the message Pause" in client.text("error")["message"]


def test_the_written_file_is_checked_as_any_other(tmp_path):
    (tmp_path / "bad.yaml").write_text("segmentation: {hue: 3}")
    with pytest.raises(ConfigError):
        Config.from_file(tmp_path / "bad.yaml")


def test_the_number_of_cables_is_saved_and_named_in_the_next_command(tmp_path):
    target = tmp_path / "cable.yaml"
    with tuning(target=target) as (client, _):
        draw(client)
        client.send(type="objects", objects=1)
        client.text("state", lambda state: state["objects"] == 1)
        client.send(type="save")
        assert client.text("saved")["command"] == f"{COMMAND} --objects 1"
        client.send(type="objects", objects=0)
        assert "objects" in client.text("error")["message"]
        client.send(type="objects", objects=None)
        client.text("state", lambda state: state["objects"] is None)
    assert Config.from_file(target).linking.objects == 1


class BrokenSource(CableSource):
    """A cable that is cut in two far pieces in two frames."""

    def frame(self, index):
        found = super().frame(index)
        if index not in (5, 9):
            return found
        image = found.image.copy()
        image[:, 70:130] = (90, 120, 90)
        return Frame(image=image, index=index, name=found.name)


def test_the_strip_names_the_field_for_the_number_of_cables():
    config = Config(segmentation=SegmentationConfig(hsv=(HsvRange.parse("5:20"),))).replace(
        {"linking.max_gap_widths": 2.0}
    )
    with tuning(BrokenSource(20), config) as (client, _):
        warnings = client.text("strip", lambda strip: strip["done"])["warnings"]
        assert warnings == ["1 object in 18 of 20 frames, more in 2; if there is one cable: set Cables to 1"]
        client.send(type="objects", objects=1)
        client.text("state", lambda state: state["objects"] == 1)
        strip = client.text("strip", lambda strip: strip["done"])
        assert (strip["warnings"], {count for _, count in strip["objects"]}) == ([], {1})


def test_a_region_of_interest_is_looked_at_alone_and_saved(tmp_path):
    box = [20, 10, 150, 100]
    target = tmp_path / "cable.yaml"
    with tuning(target=target) as (client, _):
        client.send(type="region", box=box)
        state = client.text("state", lambda state: state["roi"])
        assert (state["roi"], state["can_undo"]) == (box, True)
        header, parts = client.picture(lambda header: header["roi"] is not None)
        assert header["roi"] == [[20, 10], [169, 10], [169, 109], [20, 109]]
        guess = mask_of(parts)
        assert guess.any()
        draw(client)
        header, parts = client.picture(lambda header: not header["suggested"])
        found, inside = mask_of(parts), np.zeros(SIZE, bool)
        inside[10:110, 20:170] = True
        for mask in (guess, found):
            assert not (mask & ~inside).any()
        true = cable_mask(0.0).astype(bool) & inside
        assert (found & true).sum() / (found | true).sum() > 0.8
        client.text("strip", lambda strip: strip["done"] and strip["objects"])
        client.send(type="save")
        saved = client.text("saved")
        client.send(type="region", corners=[[20, 10], [119, 10], [60, 90]])
        assert client.text("state", lambda state: state["roi"] != box)["roi"] == [[20, 10], [119, 10], [60, 90]]
        client.send(type="clear")
        assert client.text("state", lambda state: not state["strokes"])["roi"] is not None
        client.send(type="region", corners=[[0, 0], [50, 50], [50, 0], [0, 50]])
        assert "cross or overlap" in client.text("error")["message"]
        client.send(type="region")
        assert client.text("state", lambda state: state["roi"] is None)["roi"] is None
    config = Config.from_file(target)
    assert config.region.roi == tuple(box)
    assert config == Config.from_yaml(saved["text"])
    frame = CableSource().frame(0)
    assert np.array_equal(Pipeline(config).trace(frame).mask, found)
    with tuning(config=config, target=target) as (client, _):
        assert client.text("state")["roi"] == box


def test_the_ground_s_colours_are_counted_in_the_region_alone():
    class Cluttered(CableSource):
        def frame(self, index):
            frame = super().frame(index)
            image = frame.image.copy()
            image[100:] = image[cable_mask(0.0).astype(bool)][0]  # the cable's colour all over the bottom
            return Frame(image=image, index=index, name=frame.name)

    with tuning(Cluttered(2)) as (client, _):
        draw(client)
        client.send(type="save")
        whole = Config.from_yaml(client.text("saved")["text"])
        client.send(type="region", box=[0, 0, SIZE[1], 100])
        client.text("state", lambda state: state["roi"])
        client.send(type="save")
        part = Config.from_yaml(client.text("saved")["text"])
    (one,), (other,) = (config.segmentation.colour.pictures for config in (whole, part))
    assert one.cable == other.cable
    assert one.sample != other.sample


def test_a_region_alone_can_be_saved():
    with tuning() as (client, _):
        client.send(type="region", box=[20, 10, 100, 90])
        client.text("state", lambda state: state["roi"])
        client.send(type="save")
        assert Config.from_yaml(client.text("saved")["text"]) == Config().with_roi((20, 10, 100, 90))


class TwoCables(CableSource):
    """A source whose frames show the cable and a straight one of its colour below it."""

    def frame(self, index):
        frame = super().frame(index)
        image = frame.image.copy()
        image[-12:-7, 10:-10] = image[cable_mask(0.03 * index)].mean(axis=0)
        return Frame(index=frame.index, image=image, name=frame.name)


def test_a_deleted_object_is_drawn_on_as_no_cable_and_undo_brings_it_back():
    with tuning(TwoCables(3)) as (client, _):
        header, _ = client.picture(lambda header: header["suggested"] and len(header["curves"]) == 2)
        height = header["size"][1]
        client.send(type="delete", frame=0, point=[60, height - 10])
        state = client.text("state", lambda state: state["strokes"])
        low = [stroke for stroke in state["strokes"] if stroke["points"][0][1] > height - 20]
        assert low
        assert not any(stroke["cable"] for stroke in low)
        assert any(stroke["cable"] for stroke in state["strokes"])
        client.send(type="undo")
        assert client.text("state", lambda state: not state["strokes"])
        client.send(type="delete", frame=0, point=[1, 1])
        assert "no object at this place" in client.text("error")["message"]


@pytest.mark.parametrize(
    "section", [SegmentationConfig(local="brighter"), SegmentationConfig(hsv=(HsvRange.parse("5:20,80:255,60:255"),))]
)
def test_strokes_on_the_ground_alone_are_refused_where_something_else_makes_the_mask(tmp_path, section):
    with tuning(TwoCables(3), Config(segmentation=section), tmp_path / "cable.yaml") as (client, _):
        header, _ = client.picture(lambda header: len(header["curves"]) == 2)
        point = [60, header["size"][1] - 10]
        client.send(type="delete", frame=0, point=point)
        assert "where strokes make the mask" in client.text("error")["message"]
        draw(client, cable=False, points=[[20, 5], [60, 5]])
        assert len(client.text("state", lambda state: state["strokes"])["strokes"]) == 1
        client.send(type="save")
        assert "along" in client.text("error")["message"]
        assert not (tmp_path / "cable.yaml").exists()
        draw(client)
        client.send(type="save")
        client.text("saved")
        client.send(type="delete", frame=0, point=point)
        assert client.text("state", lambda state: sum(not one["cable"] for one in state["strokes"]) == 2)


def test_a_stroke_that_is_drawn_while_an_object_is_deleted_stays(monkeypatch):
    entered, go_on, find = Event(), Event(), tune_session.object_at

    def slow(*args):
        entered.set()
        go_on.wait(20.0)
        return find(*args)

    monkeypatch.setattr(tune_session, "object_at", slow)
    with tuning(TwoCables(3)) as (client, _):
        client.picture(lambda header: header["suggested"] and len(header["curves"]) == 2)
        client.send(type="delete", frame=0, point=[60, SIZE[0] - 10])
        assert entered.wait(20.0)
        draw(client, points=[[5, 5], [60, 5]], cable=False)
        client.text("state", lambda state: state["strokes"])
        go_on.set()
        strokes = client.text("state", lambda state: len(state["strokes"]) > 1)["strokes"]
        assert strokes[0]["points"] == [[5, 5], [60, 5]]
        assert any(stroke["cable"] for stroke in strokes)


def test_a_guess_is_offered_once_it_holds_on_frames_all_over_the_video():
    with tuning() as (client, _):
        assert client.picture(lambda header: header["offered"])[0]["suggested"]


@pytest.fixture
def guessed(monkeypatch):
    """Return the frames whose guesses were tried, in order."""
    indices, guess = [], TuneSession._guess
    monkeypatch.setattr(TuneSession, "_guess", lambda self, index: indices.append(index) or guess(self, index))
    return indices


def test_of_the_frames_that_are_passed_the_guess_of_the_last_alone_is_tried(guessed):
    go_on = Event()

    class Slow(CableSource):
        def __iter__(self):
            yield from super().__iter__()
            go_on.wait(20.0)

    with tuning(Slow(12)) as (client, _):
        for index in (0, 5, 3, 7):
            client.send(type="seek", index=index)
            client.picture(lambda header, index=index: header["index"] == index)
        go_on.set()
        client.picture(lambda header: header["offered"])
        assert guessed == [7]
        client.send(type="seek", index=3)
        client.picture(lambda header: header["offered"] and header["index"] == 3)
        assert guessed == [7, 3]


def test_no_guess_is_tried_on_a_camera(guessed):
    with tuning(CableSource(30, live=True)) as (client, _):
        for _ in range(5):
            client.picture(lambda header: header["index"] == 29 and header["curves"])
            client.send(type="seek", index=None)
        assert guessed == []


class GroundLater(CableSource):
    """A source whose first frame alone shows the cable on another ground: later the ground has its colour."""

    def frame(self, index):
        frame = super().frame(index)
        if index == 0:
            return frame
        image = frame.image.copy()
        image[: len(image) // 2 : 7] = image[: len(image) // 2 : 7] // 2 + image[cable_mask(0.03 * index)][0] // 2
        image[40:52, ::3] = image[cable_mask(0.03 * index)][0]
        return Frame(index=frame.index, image=image, name=frame.name)


def test_a_guess_that_teaches_the_ground_of_other_frames_is_not_offered():
    with tuning(GroundLater(6)) as (client, _):
        assert not client.picture()[0]["offered"]
        assert not client.picture()[0]["offered"]  # after it was tried


def test_a_large_picture_is_drafted_on_a_smaller_one_and_the_mask_has_its_size():
    source = CableSource(1)
    frame = source.frame(0)
    large = Frame(image=np.kron(frame.image, np.ones((6, 6, 1), np.uint8)))
    translator = Translator("large", lambda index: large, SegmentationConfig())
    points = tuple((6.0 * x + 2.5, 6.0 * y + 2.5) for x, y in along())
    document = TuneDocument(strokes=(DrawnStroke(0, points, True, 6.0),))
    mask = translator.draft_of(document)(large)
    true = np.kron(cable_mask(0.0), np.ones((6, 6))) > 0
    assert mask.shape == true.shape
    assert (mask & true).sum() / (mask | true).sum() > 0.8
    assert translator.draft_of(TuneDocument(ranges=((0, 9, 0, 255, 0, 255),), method="ranges")) is None
