"""Logs for the viewer of Rerun: with a stand-in for its package, and with the package where there is one."""

import sys
from types import SimpleNamespace

import cv2
import numpy as np
import pytest
from cli.cli_inputs import run
from drawings import draw_cable, wave

import dloftbs
from dloftbs import sinks
from dloftbs.errors import InputError, SinkError

SIZE = (120, 160)
CAMERA = dloftbs.PinholeCamera(150.0, 150.0, 79.5, 59.5)


def frames():
    for index in range(2):
        mask = draw_cable(wave(SIZE, 1.0, 0.05 * index), 7, SIZE)
        image = np.full((*SIZE, 3), 90, np.uint8)
        depth = np.full(SIZE, 600, np.uint16)
        yield dloftbs.Frame(mask=mask, image=image, depth=depth, camera=CAMERA, index=index, stamp=index / 30)


class Recording:
    def __init__(self, name):
        self.logged, self.times, self.calls = {}, [], []

    def log(self, entity, value, static=False):
        self.logged.setdefault(entity, []).append(value)

    def set_time(self, timeline, **at):
        self.times.append((timeline, at))

    def save(self, path):
        self.calls.append(("save", path))

    def spawn(self):
        self.calls.append("spawn")

    def flush(self):
        self.calls.append("flush")

    def disconnect(self):
        self.calls.append("disconnect")


@pytest.fixture
def recordings(monkeypatch):
    made = []

    def record(name):
        made.append(Recording(name))
        return made[-1]

    def archetype(name):
        return lambda *values, **options: SimpleNamespace(
            name=name, values=values, options=options, compress=lambda: name
        )

    names = "Pinhole", "Image", "SegmentationImage", "DepthImage", "LineStrips2D", "LineStrips3D", "Scalars"
    rerun = SimpleNamespace(
        RecordingStream=record, ViewCoordinates=SimpleNamespace(RDF="RDF"), **{name: archetype(name) for name in names}
    )
    monkeypatch.setitem(sys.modules, "rerun", rerun)
    return made


def write(sink):
    pipeline = dloftbs.Pipeline()
    with sink:
        for frame in frames():
            sink.write(frame, pipeline.process(frame))


def test_frames_and_curves_are_logged_by_id_at_their_times(recordings, tmp_path):
    write(sinks.open(tmp_path / "new" / "run.rrd"))
    (recording,) = recordings
    assert recording.calls == [("save", str(tmp_path / "new" / "run.rrd")), "flush", "disconnect"]
    assert recording.times[2:] == [("frame", {"sequence": 1}), ("stamp", {"duration": 1 / 30})]
    assert set(recording.logged) == {"world", "length_px/1", "length_m/1", "world/curves"} | {
        f"world/camera{what}" for what in ("", "/image", "/depth", "/curves")
    }
    flat, tubes = recording.logged["world/camera/curves"][1], recording.logged["world/curves"][1]
    assert flat.values[0][0].shape == (100, 2)
    assert flat.options["labels"][0].startswith("#1")
    assert tubes.values[0][0][:, 2] == pytest.approx(0.6, abs=0.03)
    assert tubes.options["radii"][0] == pytest.approx(4.5 * 0.6 / 150.0, rel=0.2)
    assert recording.logged["world/camera/depth"][0].options["meter"] == pytest.approx(1000.0)


def test_a_mask_that_is_a_probability_is_shown_from_one_half_on(recordings, tmp_path):
    cable = next(frames()).mask > 0
    frame = dloftbs.Frame(mask=np.where(cable, 0.9, 0.02))
    with sinks.open(tmp_path / "run.rrd") as sink:
        sink.write(frame, dloftbs.FrameResult((), (), None, SIZE))
    (shown,) = recordings[0].logged["world/camera/mask"]
    assert np.array_equal(shown.values[0], cable)


def test_the_viewer_is_started_and_stays_open(recordings):
    sink = sinks.RerunViewerSink()
    write(sink)
    assert recordings[0].calls == ["spawn", "flush", "disconnect"]
    with pytest.raises(SinkError, match="closed"):
        sink.write(next(frames()), dloftbs.FrameResult((), (), None, SIZE))


def test_track_shows_a_stream_in_the_viewer(recordings, tmp_path):
    cv2.imwrite(str(tmp_path / "0.png"), next(frames()).mask)
    run("track", tmp_path, "--rerun")
    assert recordings[0].calls[0] == "spawn"
    assert len(recordings[0].logged["world/camera/curves"]) == 1


def test_without_the_package_an_error_says_how_to_install_it(monkeypatch, tmp_path):
    monkeypatch.setitem(sys.modules, "rerun", None)
    with pytest.raises(InputError, match=r"pip install 'dloftbs\[rerun\]'"):
        sinks.open(tmp_path / "run.rrd")


def test_the_package_itself_takes_all_of_it(tmp_path):
    pytest.importorskip("rerun")
    write(sinks.open(tmp_path / "run.rrd"))
    assert (tmp_path / "run.rrd").stat().st_size > 5000
