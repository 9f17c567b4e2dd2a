from __future__ import annotations

import time
from contextlib import contextmanager
from dataclasses import replace
from threading import Thread

import cv2
import numpy as np
import pytest
from ui.page_client import SIZE, CableSource, connected, wait_for

from dloftbs import Config, Frame, PinholeCamera, Pipeline
from dloftbs.config import SegmentationConfig
from dloftbs.errors import SourceError
from dloftbs.ui import view_session
from dloftbs.ui.messages import Ack
from dloftbs.ui.server import serve
from dloftbs.ui.view_session import ViewFeed, ViewSession
from dloftbs.ui.viewer import Viewer

HSV = "5:20,80:255,60:255"
CONFIG = Config(segmentation=SegmentationConfig().with_hsv(HSV))


@contextmanager
def viewing(source, fps=200.0, config=CONFIG):
    session = ViewSession(source, config, source.name, length=source.length, live=source.live, fps=fps)
    with serve(session, port=0) as address, connected(address) as client:
        yield session, address, client


def test_a_recording_is_shown_with_its_curves():
    with viewing(CableSource(8), fps=30.0) as (_, _, client):
        state = client.text("state")
        assert (state["mode"], state["name"], state["length"], state["controls"]) == ("view", "cable.mp4", 8, True)
        header, parts = client.picture()
        assert header["size"] == [SIZE[1], SIZE[0]]
        image = cv2.imdecode(np.frombuffer(parts["image"], np.uint8), cv2.IMREAD_COLOR)
        assert image.shape == (*SIZE, 3)
        (curve,) = header["curves"]
        assert curve["label"] == "#1"
        assert len(curve["points"]) > 40
        assert curve["length"] > 150
        assert next(name for name, _ in header["stages"]) == "segmentation"
        last, _ = client.picture(lambda header: header["index"] == 7)
        assert last["delay_ms"] is None or last["delay_ms"] > 0.0
        assert client.text("state", lambda state: state["ended"])["error"] is None


def test_pause_step_restart_and_loop():
    with viewing(CableSource(40), fps=50.0) as (_, _, client):
        client.picture()
        client.send(type="pause", paused=True)
        client.text("state", lambda state: state["paused"])
        client.drain()
        client.send(type="restart")
        client.send(type="step")
        assert client.picture()[0]["index"] == 0
        client.send(type="step")
        assert client.picture()[0]["index"] == 1
        client.send(type="loop", loop=True)
        client.send(type="pause", paused=False)
        assert client.text("state", lambda state: not state["paused"])["loop"]
        client.picture(lambda header: header["index"] > 2)
        client.picture(lambda header: header["index"] < 2)  # from the beginning
        client.send(type="loop", loop=False)
        client.text("state", lambda state: state["ended"])


def test_a_recording_that_begins_anew_has_not_ended():
    with viewing(CableSource(8)) as (_, _, client):
        client.text("state", lambda state: state["ended"])
        client.send(type="pause", paused=True)
        client.send(type="restart")
        assert client.text("state", lambda state: not state["ended"])["paused"]


def test_a_viewer_that_does_not_acknowledge_gets_nothing_more_and_holds_nobody_up():
    with viewing(CableSource(40), fps=50.0) as (_, address, slow), connected(address) as fast:
        first, _ = slow.picture(ack=False)
        assert fast.picture(lambda header: header["index"] == 39)
        fast.text("state", lambda state: state["ended"])
        assert all(isinstance(message, dict) for message in iter(lambda: slow.receive(0.2), None))
        slow.send(type="ack", number=77)  # of a picture that was never sent
        assert slow.receive(0.2) is None
        slow.send(type="ack", number=first["number"])
        assert slow.picture()[0]["index"] == 39


def test_a_browser_that_goes_is_forgotten_and_the_recording_waits():
    source = CableSource(2000)
    with viewing(source, fps=100.0) as (session, address, client):
        client.picture()
        client.close()
        wait_for(lambda: len(session.audience) == 0)
        with connected(address) as again:
            header, _ = again.picture()
            assert header["index"] < 1500
            again.picture(lambda later: later["index"] > header["index"])
        client.__init__(address)  # closed again at the end


def test_a_camera_begins_by_itself_and_the_newest_frame_is_shown():
    class Camera(CableSource):
        def __iter__(self):
            for frame in super().__iter__():
                time.sleep(0.005)
                yield frame

    session = ViewSession(Camera(60, live=True), CONFIG, "camera", live=True)
    with serve(session, port=0) as address:
        while session.wait(0.01):
            pass
        with connected(address) as client:
            assert client.picture()[0]["index"] == 59
            assert client.text("state")["ended"]
            client.send(type="restart")
            assert "no beginning" in client.text("error")["message"]


def test_a_number_of_cables_that_cannot_be_is_an_error_of_that_browser_alone():
    with viewing(CableSource(2000), fps=50.0, config=CONFIG.replace({"linking.branched": True})) as (
        session,
        _,
        client,
    ):
        client.picture()
        client.send(type="objects", objects=2)
        error = client.text("error")
        assert (error["kind"], session.state()["objects"]) == ("ConfigError", None)
        seen = client.picture()[0]["index"]
        assert client.picture(lambda header: header["index"] > seen + 20)
        assert session.wait(0.01)


def test_the_number_of_cables_holds_from_the_next_frame_on(monkeypatch):
    asked = []
    monkeypatch.setattr(
        view_session, "Pipeline", lambda config: asked.append(config.linking.objects) or Pipeline(config)
    )
    with viewing(CableSource(2000), fps=50.0) as (_, _, client):
        client.picture()
        client.send(type="objects", objects=1)
        assert client.text("state", lambda state: state["objects"] == 1)
        assert len(client.picture(lambda header: header["index"] > 30)[0]["curves"]) == 1
    assert asked == [None, 1]


def test_a_recording_that_can_be_read_once_keeps_its_pace_and_does_not_begin_anew():
    source = CableSource(6)
    session = ViewSession(source, CONFIG, source.name, length=source.length, once=True, fps=30.0)
    began = time.monotonic()
    with serve(session, port=0) as address, connected(address) as client:
        indices = [client.picture()[0]["index"]]
        while indices[-1] < 5:  # a slow browser is shown the newest picture, so that some are left out
            indices.append(client.picture()[0]["index"])
        assert time.monotonic() - began > 5 / 30.0
        assert indices == sorted(set(indices))
        assert client.text("state", lambda state: state["ended"])
        client.send(type="restart")
        assert "no beginning" in client.text("error")["message"]
    assert source.passes == 1


def test_an_error_of_the_source_is_told_to_the_page_and_to_the_command():
    class Broken(CableSource):
        def __iter__(self):
            yield self.frame(0)
            raise SourceError("the disk is gone")

    with viewing(Broken()) as (session, _, client):
        assert client.text("state", lambda state: state["ended"])["error"] == "the disk is gone"
        with pytest.raises(SourceError, match="the disk is gone"):
            session.wait(5.0)


def test_a_source_whose_name_is_no_utf8_is_shown():
    class Named(CableSource):
        def __init__(self):
            super().__init__(3)
            self.name = "kabel_\udce4.mp4"

        def frame(self, index):
            return replace(super().frame(index), name=f"{self.name}#{index}")

        def __iter__(self):
            yield from super().__iter__()
            raise SourceError(f"{self.name}: the disk is gone")

    with viewing(Named()) as (_, _, client):
        assert client.text("state")["name"] == r"kabel_\xe4.mp4"
        assert client.picture()[0]["name"].startswith(r"kabel_\xe4.mp4#")
        ended = client.text("state", lambda state: state["ended"])
        assert ended["error"] == r"kabel_\xe4.mp4: the disk is gone"


def test_curves_in_metres_and_masks_without_an_image():
    mask = np.zeros(SIZE, np.uint8)
    mask[58:64, 20:180] = 1
    camera = PinholeCamera(150.0, 150.0, 99.5, 59.5)
    frame = Frame(mask=mask, depth=np.full(SIZE, 0.5), camera=camera)
    feed = ViewFeed("masks")
    with serve(feed, port=0) as address, connected(address) as client:
        feed.publish(frame, Pipeline().process(frame))
        (curve,) = client.picture()[0]["curves"]
        space = np.reshape(curve["space"], (-1, 3))
        assert np.allclose(space[:, 2], 0.5, atol=0.02)
        assert curve["length_m"] == pytest.approx(160 / 300, rel=0.05)
        feed.end()
        assert client.text("state", lambda state: state["ended"])["controls"] is False
        client.send(type="pause", paused=True)
        assert "does not take the message Pause" in client.text("error")["message"]


def test_the_last_picture_is_painted_before_the_command_ends():
    frames = list(CableSource(5))
    feed, pipeline = ViewFeed("cable.mp4"), Pipeline(hsv=HSV)
    with serve(feed, port=0) as address, connected(address) as client:
        client.text("state")
        for frame in frames:
            feed.publish(frame, pipeline.process(frame))
        finishing = Thread(target=feed.finish)
        finishing.start()
        assert client.picture(lambda header: header["index"] == 4)
        finishing.join(10.0)
        assert not finishing.is_alive()


def test_a_browser_that_has_no_picture_yet_is_waited_for():
    (frame,) = CableSource(1)
    feed = ViewFeed("cable.mp4")
    viewer = Viewer(None, feed.render)
    feed.join(viewer)
    feed.publish(frame, Pipeline(hsv=HSV).process(frame))
    finishing = Thread(target=feed.finish)
    finishing.start()
    finishing.join(0.2)
    assert finishing.is_alive()
    feed.handle(viewer, Ack(1))
    finishing.join(10.0)
    assert not finishing.is_alive()
    feed.close()


def test_a_broken_mask_is_warned_of():
    feed = ViewFeed("noise")
    with serve(feed, port=0) as address, connected(address) as client:
        pipeline = Pipeline()
        for index in range(60):
            mask = np.zeros(SIZE, np.uint8)
            for row in range(1 + index % 3):
                mask[20 + 30 * row : 26 + 30 * row, 20:180] = 1
            frame = Frame(mask=mask, index=index)
            feed.publish(frame, pipeline.process(frame))
        assert "the mask is probably broken" in client.text("state", lambda state: state["warnings"])["warnings"][0]
