"""Results as recordings: rosbags reads them, they are whole after a kill, and they can be inputs again."""

from __future__ import annotations

import errno
import shutil
import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from cli.cli_inputs import run
from mcap.reader import make_reader
from mcap.writer import Writer as McapWriter
from ros import bag_examples as bags
from rosbags.highlevel import AnyReader
from rosbags.rosbag2 import Reader
from sinks import sink_examples as examples

import dloftbs
from dloftbs import InputError, SinkError, sinks, sources
from dloftbs.config import DepthConfig
from dloftbs.data.answers import BendLimit
from dloftbs.data.depth import to_metres
from dloftbs.ros import BagSink, Recording, RosFrame
from dloftbs.ros.bag_metadata import QOS
from dloftbs.ros.message_types import MessageTypes
from dloftbs.support.documents import parse_yaml
from dloftbs.support.safe_files import AppendFile

COUNT = 4
ALWAYS = {"points", "points_px", "markers", "diagnostics", "overlay/compressed"}


@pytest.fixture(scope="module")
def tracked(tmp_path_factory):
    """Return frames with depth and their results."""
    path = bags.write_mcap(tmp_path_factory.mktemp("input") / "run.mcap", bags.entries(COUNT))
    pipeline = dloftbs.Pipeline(hsv="170:10")
    with sources.open(path) as source:
        return [(frame, pipeline.process(frame)) for frame in source]


def write(path: Path, given, **options) -> Path:
    with BagSink(path, **options) as sink:
        for frame, result in given:
            sink.write(frame, result)
    return path


def read_all(path: Path) -> dict[str, list]:
    """Read a recording by rosbags alone."""
    found: dict[str, list] = {}
    with AnyReader([path]) as reader:
        for connection, at, data in reader.messages(reader.connections):
            message = reader.deserialize(data, connection.msgtype)
            found.setdefault(connection.topic.removeprefix("/dloftbs/"), []).append((at, message))
    return found


@pytest.mark.parametrize("name", ["curves.mcap", "curves"])
def test_rosbags_reads_a_file_and_a_folder(name, tmp_path, tracked):
    found = read_all(write(tmp_path / name, tracked))
    assert found.keys() == ALWAYS
    for topic, messages in found.items():
        assert [at for at, _ in messages] == [bags.stamp_of(i) for i in range(COUNT)]
        for at, message in messages:
            head = message.markers[0].header if topic == "markers" else message.header
            assert head.stamp.sec * 10**9 + head.stamp.nanosec == at
            assert head.frame_id == "camera_optical" + "/pixels" * (topic == "points_px")
    assert [message.width for _, message in found["points_px"]] == [100] * COUNT
    assert [message.width for _, message in found["points"]] == [100] * COUNT


def test_the_input_comes_back_bit_for_bit(tmp_path, tracked):
    path = write(tmp_path / "curves.mcap", tracked, with_input=True)
    named = {"topic": "/dloftbs/image", "depth_topic": "/dloftbs/depth", "info_topic": "/dloftbs/camera_info"}
    with sources.open(path, **named) as source:
        again = list(source)
    for frame, (before, _) in zip(again, tracked, strict=True):
        np.testing.assert_array_equal(frame.image, before.image)
        np.testing.assert_array_equal(frame.depth, before.depth)
        assert (frame.camera, frame.stamp_ns, frame.frame_id) == (before.camera, before.stamp_ns, before.frame_id)


def test_results_without_tracks_and_without_depth(tmp_path):
    given = [(examples.frame(i), examples.detected(i, in_space=i == 2)) for i in range(3)]
    given.append((examples.frame(3), examples.nothing(3)))
    found = read_all(write(tmp_path / "curves.mcap", given, frame_id="lens"))
    assert [message.width for _, message in found["points_px"]] == [200, 200, 200, 0]
    assert [message.width for _, message in found["points"]] == [0, 0, 200, 0]
    assert [len(message.markers) for _, message in found["markers"]] == [1, 0, 2, 2]  # first, those of before go
    assert [at for at, _ in found["points"]] == [0, 10**9, 2 * 10**9, 3 * 10**9]
    assert found["points"][0][1].header.frame_id == "lens"


def test_masks_are_written_where_frames_bring_them(tmp_path):
    frame = dloftbs.Frame(mask=bags.mask_of(0))
    found = read_all(write(tmp_path / "curves.mcap", [(frame, dloftbs.detect(frame))], overlay=False))
    assert found.keys() == ALWAYS - {"overlay/compressed"} | {"mask"}


def test_the_mask_of_a_probability_is_cut_at_one_half(tmp_path):
    soft = np.where(bags.mask_of(0) > 0, 0.9, 0.02)
    frame = dloftbs.Frame(mask=soft)
    found = read_all(write(tmp_path / "curves.mcap", [(frame, dloftbs.detect(frame))], overlay=False))
    ((_, message),) = found["mask"]
    assert np.array_equal(message.data.reshape(soft.shape) == 255, soft > 0.5)


@pytest.mark.parametrize(
    ("counts", "unit_m"),
    [("u2", 1e-3), (">u2", 1e-3), ("u2", 1e-4), ("i2", 1e-3), ("i4", 1e-4), ("u4", 1e-3), ("f2", 1e-3), ("f8", 1e-4)],
)
def test_depth_that_is_written_is_read_back_in_metres(tmp_path, counts, unit_m):
    metres = np.full(bags.SIZE, 0.75)
    metres[0] = 0.0
    depth = metres.astype(counts) if counts.startswith("f") else np.rint(metres / unit_m).astype(counts)
    image = examples.frame(0, bags.SIZE).image
    frame = dloftbs.Frame(image, bags.mask_of(0), depth, depth_unit_m=unit_m)
    path = write(tmp_path / "curves.mcap", [(frame, dloftbs.detect(frame))], with_input=True)
    with sources.open(path, topic="/dloftbs/image", depth_topic="/dloftbs/depth") as source:
        (back,) = source
    known = to_metres(back.depth, back.depth_unit_m, DepthConfig())
    assert known[1:] == pytest.approx(0.75, abs=1e-6)
    assert np.isnan(known[0]).all()


def test_every_frame_written_is_there_before_the_file_is_closed(tmp_path, tracked, caplog):
    sink = BagSink(tmp_path / "curves.mcap")
    for i, (frame, result) in enumerate(tracked):
        sink.write(frame, result)
        shutil.copy(tmp_path / "curves.mcap", tmp_path / "killed.mcap")
        killed = Recording(tmp_path / "killed.mcap")
        assert {topic.name.removeprefix("/dloftbs/") for topic in killed.topics} == ALWAYS
        assert len(list(killed.messages({"/dloftbs/points"}))) == i + 1
    assert "it has no end mark" in caplog.text
    sink.close()
    assert len(read_all(tmp_path / "curves.mcap")["points"]) == COUNT


def test_a_process_that_is_killed_leaves_every_frame_that_it_wrote(tmp_path):
    code = (
        "import sys, itertools; import numpy as np; import dloftbs; from dloftbs.ros import BagSink\n"
        "sink = BagSink(sys.argv[1], overlay=False)\n"
        "for i in itertools.count():\n"
        "    frame = dloftbs.Frame(mask=np.ones((9, 9), bool), index=i)\n"
        "    sink.write(frame, dloftbs.FrameResult((), (), 'none', (9, 9), {}, i))\n"
        "    print(i + 1, flush=True)\n"
    )
    command = [sys.executable, "-c", code, str(tmp_path / "curves.mcap")]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        count = 0
        while count < 20:
            count = int(process.stdout.readline())
        process.send_signal(signal.SIGKILL)
        count = int([str(count), *process.stdout.read().split()][-1])
    messages = list(Recording(tmp_path / "curves.mcap").messages({"/dloftbs/diagnostics"}))
    assert len(messages) >= count >= 20


def test_diagnostics_warn_of_bends_below_a_limit(tmp_path, tracked):
    for radius, level in ((1e6, 1), (1e-6, 0)):
        path = write(tmp_path / "curves.mcap", tracked[-1:], bend_limit=BendLimit(radius, in_pixels=True))
        ((_, message),) = read_all(path)["diagnostics"]
        assert message.status[0].level == level
        assert ("bends" in message.status[0].message) == (level == 1)
    with pytest.raises(InputError, match="bend_limit must be a BendLimit"):
        BagSink(tmp_path / "other.mcap", bend_limit=40)


def test_a_recording_of_the_command_has_its_limit_of_bends(tmp_path):
    bags.write_mcap(tmp_path / "run.mcap", bags.entries(COUNT))
    path = tmp_path / "curves.mcap"
    run("track", tmp_path / "run.mcap", "--hsv", "170:10", "--min-bend-radius", "1000000px", "--out", path)
    assert [message.status[0].level for _, message in read_all(path)["diagnostics"]] == [1] * COUNT


def test_a_disk_that_is_full_costs_the_frame_at_hand(tmp_path, tracked, monkeypatch):
    sink = BagSink(tmp_path / "curves.mcap")
    sink.write(*tracked[0])

    def full(*_):
        raise OSError(errno.ENOSPC, "No space left on device")

    with monkeypatch.context() as patch:
        patch.setattr(AppendFile, "_write_all", full)
        with pytest.raises(SinkError, match="No space left on device"):
            sink.write(*tracked[1])
    sink.close()
    assert len(list(Recording(tmp_path / "curves.mcap").messages({"/dloftbs/points"}))) == 1


def test_a_file_that_was_cut_has_no_metadata_that_count_what_is_not_there(tmp_path, monkeypatch):
    given = dloftbs.Frame(mask=bags.mask_of(0)), dloftbs.FrameResult((), (), "none", bags.SIZE)
    sink = BagSink(tmp_path / "curves", overlay=False)
    sink.write(*given)

    def full(*_):
        raise OSError(errno.ENOSPC, "No space left on device")

    with monkeypatch.context() as patch:
        patch.setattr(AppendFile, "_write_all", full)
        with pytest.raises(SinkError, match="No space left on device"):
            sink.write(*given)
    sink.close()
    assert [path.name for path in (tmp_path / "curves").iterdir()] == ["curves_0.mcap"]
    assert len(list(Recording(tmp_path / "curves").messages({"/dloftbs/points"}))) == 1


@pytest.mark.parametrize("with_input", [False, True])
@pytest.mark.parametrize("name", ["curves.mcap", "curves"])
def test_an_older_recording_is_replaced_with_the_first_frame_and_not_before(name, with_input, tmp_path, tracked):
    def contents():
        return {path.name: path.read_bytes() for path in tmp_path.rglob("*") if path.is_file()}

    write(tmp_path / name, tracked)
    older = contents()
    write(tmp_path / name, [])
    assert contents() == older
    sink = BagSink(tmp_path / name, with_input=with_input)
    sink.write(*tracked[0])
    assert "metadata.yaml" not in contents()
    sink.close()
    assert contents().keys() == older.keys()
    assert [at for at, _ in read_all(tmp_path / name)["points"]] == [bags.stamp_of(0)]


def test_a_name_opens_it(tmp_path):
    with sinks.open(tmp_path / "a.mcap") as sink:
        assert isinstance(sink, BagSink)
    assert read_all(tmp_path / "a.mcap") == {}


def test_times_that_messages_cannot_have_are_said(tmp_path):
    frame = dloftbs.Frame(mask=bags.mask_of(0), stamp=-1.0)
    with BagSink(tmp_path / "a.mcap") as sink, pytest.raises(InputError, match="must be 0 to 2147483647 s, got -1 s"):
        sink.write(frame, dloftbs.detect(frame))


def test_a_package_that_is_missing(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "mcap.writer", None)
    with pytest.raises(SinkError, match=r"pip install 'dloftbs\[ros\]'"):
        sinks.open(tmp_path / "a.mcap")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("storage", ["mcap", "sqlite3"])
def test_the_command_copies_a_recording_as_it_is(tmp_path, monkeypatch, storage):
    monkeypatch.chdir(tmp_path)
    note = examples_of_notes(COUNT)
    bags.write_ros2(Path("bag"), [*bags.entries(COUNT), *note], storage)
    asked = ("--topic", bags.COLOUR_TOPIC, "--hsv", "170:10", "--with-input")
    run("track", "bag", *asked, "--out", "curves.mcap", "--out", "all/")
    topics = [bags.COLOUR_TOPIC, bags.DEPTH_TOPIC, bags.INFO_TOPIC, "/notes"]
    before = [as_recorded(raw) for raw in Recording("bag").messages(topics)]
    assert len(before) == 4 * COUNT
    for path in ("curves.mcap", "all"):
        copy = Recording(path)
        assert [as_recorded(raw) for raw in copy.messages(topics)] == before
        assert {topic.name for topic in copy.topics} == {*topics, *(f"/dloftbs/{name}" for name in ALWAYS)}
    with Reader(Path("all")) as reader:  # rosbags' own
        kinds = {connection.topic: connection for connection in reader.connections}
        assert kinds["/notes"].msgtype == "std_msgs/msg/String"
        assert kinds[bags.COLOUR_TOPIC].msgcount == COUNT
    run("track", "all/", *asked, "--out", "again.mcap")
    assert [as_recorded(raw) for raw in Recording("again.mcap").messages(topics)] == before
    assert Path("curves.config.yaml").exists()


def examples_of_notes(count):
    """Return messages of a type that nobody here reads, the last ones after the last image."""
    return [("/notes", bags.stamp_of(i + 2), bags.MAKE2("std_msgs/msg/String", data=f"note {i}")) for i in range(count)]


def as_recorded(raw):
    return raw.topic, raw.stamp_ns, bytes(raw.data)


def test_a_copy_keeps_definitions_qos_times_and_numbers(tmp_path):
    definition, qos = b"int32 grams\n", "- history: 1\n  depth: 5\n  durability: 1\n"
    with (tmp_path / "run.mcap").open("wb") as file:
        writer = McapWriter(file)
        writer.start("ros2")
        types = MessageTypes()
        image = writer.register_schema(bags.IMAGE, "ros2msg", types.definition(bags.IMAGE).encode())
        weight = writer.register_schema("scale_msgs/msg/Weight", "ros2msg", definition)
        image = writer.register_channel("/image", "cdr", image)
        weight = writer.register_channel("/w", "cdr", weight, {QOS: qos})
        writer.add_message(weight, 5, b"\0\1\0\0\7\0\0\0", 3, sequence=9)
        message = bags.raw_image(bags.photo_of(0), "bgr8", 10)
        writer.add_message(image, 20, types.write(message), 15, sequence=4)
        writer.finish()
    with sources.open(tmp_path / "run.mcap", keep_messages=True) as source:
        given = [(frame, dloftbs.detect(frame, hsv="170:10")) for frame in source]
    write(tmp_path / "copy", given, with_input=True)
    with (tmp_path / "copy" / "copy_0.mcap").open("rb") as file:
        found = {channel.topic: (schema, channel, raw) for schema, channel, raw in make_reader(file).iter_messages()}
    schema, channel, raw = found["/w"]
    assert (schema.name, schema.encoding, schema.data) == ("scale_msgs/msg/Weight", "ros2msg", definition)
    assert channel.metadata == {QOS: qos}
    assert (raw.log_time, raw.publish_time, raw.sequence, raw.data) == (5, 3, 9, b"\0\1\0\0\7\0\0\0")
    assert (found["/image"][2].log_time, found["/image"][2].publish_time, found["/image"][2].sequence) == (20, 15, 4)
    (metadata,) = parse_yaml((tmp_path / "copy" / "metadata.yaml").read_text())
    listed = [entry["topic_metadata"] for entry in metadata["rosbag2_bagfile_information"]["topics_with_message_count"]]
    assert {entry["name"]: entry[QOS] for entry in listed if entry[QOS]} == {"/w": qos}


def test_each_message_goes_with_one_frame(tmp_path):
    path = bags.write_mcap(tmp_path / "run.mcap", [*bags.entries(COUNT), *examples_of_notes(COUNT)])
    whole = [as_recorded(raw) for raw in Recording(path).messages([topic.name for topic in Recording(path).topics])]
    with sources.open(path, keep_messages=True) as source:
        frames = list(source)
        assert [as_recorded(raw) for frame in frames for raw in frame.recorded] == whole
        assert len(list(source)) == COUNT
    with sources.open(path) as source:
        assert [frame.recorded for frame in source] == [None] * COUNT


def test_a_frame_carries_its_own_image_and_depth_and_the_last_one_the_rest(tmp_path):
    path = bags.write_mcap(tmp_path / "run.mcap", [*bags.entries(COUNT), *examples_of_notes(COUNT)])
    with sources.open(path, keep_messages=True) as source:
        carried = [[(raw.topic, raw.stamp_ns) for raw in frame.recorded] for frame in source]
    own = [[(topic, at) for topic, at, _ in bags.entries(COUNT)[3 * i : 3 * i + 3]] for i in range(COUNT)]
    assert carried == [*own[:-1], own[-1] + [(topic, at) for topic, at, _ in examples_of_notes(COUNT)]]


def test_results_are_logged_by_the_clock_of_what_is_copied(tmp_path):
    late_ns = 10**15  # as of simulated time
    given = [(topic, at + late_ns, message) for topic, at, message in bags.entries(2)]
    path = bags.write_mcap(tmp_path / "run.mcap", given)
    with sources.open(path, keep_messages=True) as source:
        frames = [*source, RosFrame(mask=bags.mask_of(2), stamp_ns=bags.stamp_of(2), recorded=())]
    empty = dloftbs.FrameResult((), (), "none", bags.SIZE)
    write(tmp_path / "copy", [(frame, empty) for frame in frames], with_input=True, overlay=False)
    with (tmp_path / "copy" / "copy_0.mcap").open("rb") as file:
        found = [raw for _, channel, raw in make_reader(file).iter_messages() if channel.topic == "/dloftbs/points"]
    last = [bags.stamp_of(i) + 5_000_000 + late_ns for i in (0, 1, 1)]
    assert [(raw.log_time, raw.publish_time) for raw in found] == [(at, bags.stamp_of(i)) for i, at in enumerate(last)]
    with Reader(tmp_path / "copy") as reader:
        assert reader.duration < 10**9


def test_of_ros_1_and_of_our_own_topics_the_input_is_written_anew(tmp_path, tracked):
    path = bags.write_ros1(tmp_path / "run.bag", bags.entries(2, make=bags.MAKE1))
    with sources.open(path, keep_messages=True) as source:
        assert [frame.recorded for frame in source] == [None, None]
    path = write(tmp_path / "curves.mcap", tracked, with_input=True)
    with sources.open(path, topic="/dloftbs/image", keep_messages=True) as source:
        assert {frame.recorded for frame in source} == {None}


def test_the_command_replaces_no_input(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    bags.write_ros2(Path("bag"), bags.entries(1))
    for out in ("bag/bag.mcap", "bag/"):
        result = run("track", "bag", "--hsv", "170:10", "--out", out, code=2)
        assert "would replace" in result.output + result.stderr
    run("track", "bag", "--hsv", "170:10", "--out", "a.jsonl", "--with-input", code=2)
    assert len(list(Recording(Path("bag")).messages({bags.COLOUR_TOPIC}))) == 1
