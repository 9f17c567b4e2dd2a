"""Recordings of every kind give the frames that went into them, whole or cut."""

from __future__ import annotations

import logging
import shutil
import sqlite3
import sys
from pathlib import Path

import numpy as np
import pytest
from mcap.writer import CompressionType, IndexType
from ros import bag_examples as bags
from rosbags.rosbag1 import Writer as Writer1
from rosbags.rosbag2 import CompressionFormat, CompressionMode

import dloftbs
from dloftbs import InputError, PinholeCamera, SourceError, sources
from dloftbs.camera import DepthRegistration
from dloftbs.ros import BagSource, RosFrame

COUNT = 6
ZSTD = CompressionFormat.ZSTD
NO_INDEX = {"repeat_channels": False, "repeat_schemas": False, "use_statistics": False, "index_types": IndexType.NONE}
WRITERS = {
    "rosbag2 mcap": lambda path: bags.write_ros2(path, bags.entries(COUNT)),
    "rosbag2 sqlite": lambda path: bags.write_ros2(path, bags.entries(COUNT), "sqlite3"),
    "mcap in zstd": lambda path: bags.write_ros2(path, bags.entries(COUNT), mode=CompressionMode.STORAGE, form=ZSTD),
    "mcap by message": lambda path: bags.write_ros2(path, bags.entries(COUNT), mode=CompressionMode.MESSAGE, form=ZSTD),
    "sqlite by message": lambda path: bags.write_ros2(
        path, bags.entries(COUNT), "sqlite3", mode=CompressionMode.MESSAGE, form=ZSTD
    ),
    "sqlite by file": lambda path: bags.write_ros2(
        path, bags.entries(COUNT), "sqlite3", mode=CompressionMode.FILE, form=ZSTD
    ),
    "bare mcap": lambda path: bags.write_mcap(path.with_suffix(".mcap"), bags.entries(COUNT)),
    "mcap in lz4": lambda path: bags.write_mcap(
        path.with_suffix(".mcap"), bags.entries(COUNT), compression=CompressionType.LZ4
    ),
    "mcap without chunks": lambda path: bags.write_mcap(
        path.with_suffix(".mcap"), bags.entries(COUNT), use_chunking=False
    ),
    "mcap without a summary": lambda path: bags.write_mcap(
        path.with_suffix(".mcap"), bags.entries(COUNT), use_summary_offsets=False, **NO_INDEX
    ),
    "ros 1": lambda path: bags.write_ros1(path.with_suffix(".bag"), bags.entries(COUNT, make=bags.MAKE1)),
    "ros 1 in bz2": lambda path: bags.write_ros1(
        path.with_suffix(".bag"), bags.entries(COUNT, make=bags.MAKE1), Writer1.CompressionFormat.BZ2
    ),
    "ros 1 in lz4": lambda path: bags.write_ros1(
        path.with_suffix(".bag"), bags.entries(COUNT, make=bags.MAKE1), Writer1.CompressionFormat.LZ4
    ),
}
CUT = ("bare mcap", "mcap in zstd", "mcap in lz4", "mcap without chunks", "ros 1", "ros 1 in lz4", "rosbag2 sqlite")


def only_file(path: Path) -> Path:
    """Return the file of a recording."""
    return path if path.is_file() else next(p for p in path.iterdir() if p.suffix in (".mcap", ".db3", ".zstd"))


def check(frame: RosFrame, i: int) -> None:
    """Compare a frame with what was written at its place."""
    assert (frame.index, frame.stamp_ns, frame.frame_id) == (i, bags.stamp_of(i), "camera_optical")
    assert frame.stamp == bags.stamp_of(i) / 10**9
    np.testing.assert_array_equal(frame.image, bags.photo_of(i))


def read(path: Path, **options) -> tuple[list[RosFrame], BagSource]:
    with sources.open(path, **options) as source:
        return list(source), source


@pytest.mark.parametrize("kind", WRITERS)
def test_every_kind_of_recording(kind, tmp_path, caplog):
    frames, source = read(WRITERS[kind](tmp_path / "run"))
    assert len(frames) == COUNT
    for i, frame in enumerate(frames):
        check(frame, i)
        assert (frame.depth == 600 + i).all()
        assert frame.camera == PinholeCamera(150.0, 150.0, 80.0, 60.0, size=bags.SIZE)
    assert (source.length, source.skipped) == (None if kind == "mcap without a summary" else COUNT, 0)
    assert not caplog.records


def test_a_folder_without_its_metadata(tmp_path):
    path = WRITERS["rosbag2 sqlite"](tmp_path / "run")
    (path / "metadata.yaml").unlink()
    assert len(read(path)[0]) == len(read(only_file(path))[0]) == COUNT


def test_a_recording_in_several_files(tmp_path):
    folder = tmp_path / "run"
    folder.mkdir()
    given = bags.entries(12)
    bags.write_mcap(folder / "run_0.mcap", given[:9])
    bags.write_mcap(folder / "run_1.mcap", given[9:30])
    bags.write_mcap(folder / "run_10.mcap", given[30:])
    frames, source = read(folder)
    assert [frame.stamp_ns for frame in frames] == [bags.stamp_of(i) for i in range(12)]
    assert source.length == 12
    shutil.move(folder / "run_10.mcap", folder / "other.mcap")
    with pytest.raises(SourceError, match="holds several recordings; name one of"):
        sources.open(folder)


@pytest.mark.parametrize("kind", CUT)
def test_a_recording_that_was_cut_anywhere_is_read_as_far_as_it_goes(kind, tmp_path, caplog):
    whole = only_file(WRITERS[kind](tmp_path / "run"))
    data = whole.read_bytes()
    cut = tmp_path / f"cut{whole.suffix}"
    counts = []
    for share in np.linspace(0.0, 0.999, 25):
        cut.write_bytes(data[: int(share * len(data))])
        caplog.clear()
        try:
            frames, _ = read(cut)
        except SourceError:
            counts.append(0)
            continue
        for i, frame in enumerate(frames):
            check(frame, i)
        assert caplog.records or len(frames) == COUNT, share  # it says so
        counts.append(len(frames))
    assert counts == sorted(counts)
    if "sqlite" not in kind:  # whose pages lie in no order
        assert counts[-1] >= COUNT - 1
        # Every message that is there as a whole is read: these of the uncompressed ones are spread evenly.
        if kind in ("bare mcap", "mcap without chunks", "ros 1"):
            expected = [int(np.floor(share * COUNT * 0.99)) for share in np.linspace(0.0, 0.999, 25)]
            assert all(count >= least - 1 for count, least in zip(counts, expected, strict=True))


@pytest.mark.parametrize("kind", [*CUT, "sqlite by message", "ros 1 in bz2"])
def test_bytes_that_are_damaged_cost_frames_and_no_more(kind, tmp_path):
    whole = only_file(WRITERS[kind](tmp_path / "run"))
    data = whole.read_bytes()
    damaged = tmp_path / f"damaged{whole.suffix}"
    rng = np.random.default_rng(5)
    for _ in range(30):
        bad = bytearray(data)
        at = int(rng.integers(0, len(bad) - 64))
        bad[at : at + int(rng.integers(1, 64))] = rng.integers(0, 256, int(rng.integers(1, 64)), "u1").tobytes()
        damaged.write_bytes(bad)
        try:
            frames, _ = read(damaged)
        except (SourceError, InputError):
            continue
        assert len(frames) <= COUNT + 1


def test_a_damaged_file_of_which_sqlite_says_what_is_no_text(tmp_path):
    path = only_file(bags.write_ros2(tmp_path / "run", bags.entries(1), "sqlite3"))
    data = path.read_bytes()
    damaged = data.replace(b"CREATE TABLE topics(", b"CREATE \x9aABLE topics(")
    assert damaged != data
    path.write_bytes(damaged)
    with pytest.raises(SourceError, match="cannot be read as a recording"):
        sources.open(path)


@pytest.mark.parametrize("suffix", [".mcap", ".db3", ".bag", ".bag.active"])
@pytest.mark.parametrize("content", [b"", b"rubbish" * 100, b"\x89MCAP0\r\n", b"#ROSBAG V2.0\n", b"SQLite format 3\0"])
def test_a_file_that_is_no_recording_is_a_typed_error(suffix, content, tmp_path):
    path = tmp_path / f"run{suffix}"
    path.write_bytes(content)
    with pytest.raises(SourceError, match="run"):
        sources.open(path)


def test_messages_of_another_type_or_size_are_skipped(tmp_path, caplog):
    given = bags.entries(5, depth=False, info=False)
    broken = bags.raw_image(bags.photo_of(1), "bgr8", bags.stamp_of(1))
    broken.height = 0
    given[1] = (bags.COLOUR_TOPIC, given[1][1], broken)
    unknown = bags.raw_image(bags.photo_of(3), "bgr8", bags.stamp_of(3))
    unknown.encoding = "bgr99"
    given[3] = (bags.COLOUR_TOPIC, given[3][1], unknown)
    path = bags.write_ros2(tmp_path / "run", given, "sqlite3")
    with sqlite3.connect(only_file(path)) as database:
        database.execute("UPDATE messages SET data = x'00010000ffffffff' WHERE id = 5")
    database.close()
    frames, source = read(path)
    assert [frame.index for frame in frames] == [0, 2]
    assert source.skipped == 3
    assert "skipped message 1" in caplog.text
    assert "unknown encoding 'bgr99'" in caplog.text
    assert "no message of sensor_msgs/msg/Image" in caplog.text


def test_depth_that_cannot_be_read_costs_the_depth_alone(tmp_path, caplog):
    given = bags.entries(3)
    given[2][2].encoding = "bgr8"
    frames, source = read(bags.write_ros2(tmp_path / "run", given))
    assert [frame.depth is not None for frame in frames] == [False, True, True]
    assert source.skipped == 0
    assert "a frame goes without depth" in caplog.text


def test_the_camera_may_come_after_the_first_images(tmp_path):
    given = bags.entries(4, depth=False)
    late = [entry for entry in given if entry[0] != bags.INFO_TOPIC]
    late.insert(3, given[0])
    frames, _ = read(bags.write_ros2(tmp_path / "run", late))
    assert [frame.index for frame in frames] == [0, 1, 2, 3]
    assert all(frame.camera is not None for frame in frames)
    assert len({id(frame.camera) for frame in frames}) == 1


@pytest.mark.parametrize(
    ("info", "said"),
    [
        (bags.camera_info(size=(60, 80)), "frames go without a camera: it is for images of"),
        (bags.camera_info(k=[0.0] * 9), "it is not calibrated"),
        (bags.camera_info(model="odd", d=(1.0,)), "unknown distortion model 'odd'"),
    ],
)
def test_a_camera_that_was_guessed_and_does_not_fit_is_left_out_with_one_warning(info, said, tmp_path, caplog):
    given = [(bags.INFO_TOPIC, at - 1, info) for _, at, _ in bags.entries(3, depth=False, info=False)]
    path = bags.write_ros2(tmp_path / "run", [*given, *bags.entries(3, depth=False, info=False)])
    frames, _ = read(path)
    assert [frame.camera for frame in frames] == [None] * 3
    assert len(caplog.records) == 1
    assert said in caplog.text
    if "calibrated" not in said:
        with pytest.raises(InputError):
            read(path, info_topic=bags.INFO_TOPIC)


def with_depth(given, frame_id="camera_optical", size=bags.SIZE, topic="/camera/depth/image_raw"):
    """Return entries whose depth is another one, of a topic that does not call it registered."""
    changed = []
    for name, at, message in given:
        if name == bags.DEPTH_TOPIC:
            stamp = message.header.stamp
            message = bags.raw_image(np.full(size, 700, np.uint16), "16UC1", stamp.sec * 10**9 + stamp.nanosec)
            message.header.frame_id = frame_id
            name = topic
        changed.append((name, at, message))
    return changed


def test_depth_that_was_guessed_is_taken_only_if_it_is_in_the_frame_of_the_images(tmp_path, caplog):
    own = bags.write_ros2(tmp_path / "own", with_depth(bags.entries(3)))
    assert all(frame.depth is not None for frame in read(own)[0])
    assert not caplog.records
    other = bags.write_ros2(tmp_path / "other", with_depth(bags.entries(3), "depth_optical"))
    assert all(frame.depth is None for frame in read(other)[0])
    assert len(caplog.records) == 1
    assert "not registered to the images: it is in the frame 'depth_optical'" in caplog.text
    caplog.clear()
    assert all(frame.depth is not None for frame in read(other, depth_topic="/camera/depth/image_raw")[0])
    assert len(caplog.records) == 1
    assert "taken for registered to the images, as its topic was named, but it is in the frame" in caplog.text
    named, _ = read(other, depth_topic="/camera/depth/image_raw")
    assert all((frame.depth == 700).all() for frame in named)


def test_depth_of_another_size(tmp_path, caplog):
    path = bags.write_ros2(tmp_path / "run", with_depth(bags.entries(3), size=(60, 80)))
    assert all(frame.depth is None for frame in read(path)[0])
    assert "another size" in caplog.text
    with pytest.raises(InputError, match="must have the frame's size"):
        read(path, depth_topic="/camera/depth/image_raw")
    cameras = PinholeCamera(75.0, 75.0, 40.0, 30.0), PinholeCamera(150.0, 150.0, 80.0, 60.0)
    registration = DepthRegistration(*cameras, np.eye(3), np.zeros(3))
    frames, _ = read(path, registration=registration)
    assert all(np.median(frame.depth) == pytest.approx(700) or np.median(frame.depth) == 0.7 for frame in frames)
    assert frames[0].camera == cameras[1]


def test_masks_grey_and_pictures_of_masks(tmp_path):
    masks = [255 * (bags.mask_of(i) > 0).astype(np.uint8) for i in range(2)]
    given = [
        ("/mask", bags.stamp_of(i), bags.raw_image(mask, "mono8", bags.stamp_of(i))) for i, mask in enumerate(masks)
    ]
    path = bags.write_ros2(tmp_path / "run", given)
    assert [np.array_equal(frame.mask, mask) for frame, mask in zip(read(path)[0], masks, strict=True)] == [True, True]
    for kind in ("image", "auto_image"):
        assert all(frame.image.shape == (*bags.SIZE, 3) for frame in read(path, kind=kind)[0])
    wide = [
        ("/grey", at, bags.raw_image(257 * mask.astype(np.uint16), "mono16", at))
        for mask, (_, at, _) in zip(masks, given, strict=True)
    ]
    wide = bags.write_ros2(tmp_path / "wide", wide)
    assert (read(wide)[0][1].mask == 257 * masks[1].astype(int)).all()
    assert (read(wide, kind="image")[0][1].image == masks[1][..., None]).all()
    lossy = [("/mask", at, bags.compressed(bags.encoded(masks[0], ".jpg"), "jpeg", at)) for _, at, _ in given]
    frames, _ = read(bags.write_ros2(tmp_path / "lossy", lossy))
    assert np.array_equal(frames[0].mask, masks[0] > 0)


def test_a_header_without_a_time_has_that_of_the_recording(tmp_path):
    given = [(bags.COLOUR_TOPIC, 5_000_000_000 + i, bags.raw_image(bags.photo_of(0), "bgr8", 0)) for i in range(2)]
    frames, _ = read(bags.write_ros2(tmp_path / "run", given))
    assert [frame.stamp_ns for frame in frames] == [5_000_000_000, 5_000_000_001]
    assert [frame.stamp for frame in read(tmp_path / "run", fps=10.0)[0]] == [0.0, 0.1]


def test_a_source_can_be_read_again_and_closed_midway(tmp_path):
    source = sources.open(WRITERS["sqlite by file"](tmp_path / "run"))
    assert len(list(source)) == len(list(source)) == COUNT
    frames = iter(source)
    next(frames)
    source.close()
    assert list(frames) == []
    with pytest.raises(SourceError, match="is closed"):
        iter(source)


def test_memory_stays_bounded_where_depth_never_comes(tmp_path, caplog):
    given = bags.entries(90, info=False)
    depth_last = sorted(given, key=lambda entry: entry[0] == bags.DEPTH_TOPIC)
    frames, _ = read(bags.write_mcap(tmp_path / "run.mcap", depth_last))
    assert [frame.index for frame in frames] == list(range(90))
    assert [frame.depth is not None for frame in frames] == [False] * 59 + [True] * 31  # the last second waits
    assert f"59 images go without depth that {bags.DEPTH_TOPIC} has: it was recorded too long" in caplog.text


def late_depth(late_ns, count=60):
    """Return what a camera publishes, its depth recorded later by as much as is said for each image."""
    given = []
    for topic, at, message in bags.entries(count, info=False):
        i = round((at - bags.START_NS) / bags.PERIOD_NS)
        given.append((topic, at + late_ns(i) * (topic == bags.DEPTH_TOPIC), message))
    return sorted(given, key=lambda entry: entry[1])


@pytest.mark.parametrize("late_ns", [300_000_000, 450_000_000, -450_000_000])
def test_depth_that_was_recorded_late_or_early_goes_to_its_image(late_ns, tmp_path, caplog):
    frames, _ = read(bags.write_mcap(tmp_path / "run.mcap", late_depth(lambda i: late_ns)))
    assert [None if frame.depth is None else frame.depth[0, 0] for frame in frames] == list(range(600, 660))
    assert "depth" not in caplog.text


@pytest.mark.parametrize(("until", "said"), [(40, ""), (41, "1 image goes"), (60, "20 images go")])
def test_images_are_counted_whose_depth_comes_more_than_a_second_later(until, said, tmp_path, caplog):
    given = late_depth(lambda i: (until - i) * bags.PERIOD_NS if 10 <= i < until else 0, count=70)
    frames, _ = read(bags.write_mcap(tmp_path / "run.mcap", given))
    missed = max(until - 40, 0)
    assert [frame.depth is None for frame in frames] == [10 <= i < 10 + missed for i in range(70)]
    assert (f"{said} without depth that {bags.DEPTH_TOPIC} has" if said else "") in caplog.text
    assert ("without depth" in caplog.text) == bool(missed)


@pytest.mark.parametrize("module", ["rosbags.typesys", "zstandard", "mcap.records"])
def test_a_package_that_is_missing_is_said_with_the_line_that_installs_it(module, tmp_path, monkeypatch):
    path = WRITERS["mcap in zstd"](tmp_path / "run")
    monkeypatch.setitem(sys.modules, module, None)
    with pytest.raises(SourceError, match=r"pip install 'dloftbs\[ros\]'"):
        read(path)


def test_what_a_recorder_that_was_killed_left_beside_its_file_counts(tmp_path):
    """SQLite's write-ahead log: the last messages are not in the file itself yet."""
    whole = only_file(bags.write_ros2(tmp_path / "run", bags.entries(COUNT), "sqlite3"))
    with sqlite3.connect(whole) as database:
        database.execute("PRAGMA journal_mode = WAL")
        database.execute("PRAGMA wal_autocheckpoint = 0")
        columns = "topic_id, timestamp, data"
        database.execute(f"INSERT INTO messages ({columns}) SELECT {columns} FROM messages WHERE id <= 3")
        database.commit()
        folder = tmp_path / "killed"
        folder.mkdir()
        for file in whole.parent.glob("*.db3*"):
            shutil.copy(file, folder / file.name)
    database.close()
    assert (folder / f"{whole.name}-wal").stat().st_size > 0
    assert len(read(folder / whole.name)[0]) == COUNT + 1


def test_a_name_that_is_none_of_a_recording(tmp_path):
    (tmp_path / "run.txt").write_text("x")
    with pytest.raises(SourceError, match="is no recording by its name"):
        BagSource(tmp_path / "run.txt")
    with pytest.raises(InputError, match="path must be a path, got 5"):
        BagSource(5)


def test_other_inputs_have_no_topics():
    with pytest.raises(InputError, match="topic: only recordings of ROS have topics"):
        sources.open("cable.mp4", topic="/camera")


def test_curves_come_out_of_a_recording(tmp_path):
    path = WRITERS["rosbag2 mcap"](tmp_path / "run")
    results = list(dloftbs.track(path, hsv="170:10"))
    assert [result.stamp for result in results] == [bags.stamp_of(i) / 10**9 for i in range(COUNT)]
    assert all(len(result.tracks) == 1 for result in results)
    assert all(track.curve_3d is not None for result in results[1:] for track in result.tracks)


def test_reading_leaves_nothing_open(tmp_path, recwarn):
    for kind in ("bare mcap", "rosbag2 sqlite", "ros 1"):
        with sources.open(WRITERS[kind](tmp_path / kind)) as source:
            next(iter(source))
    logging.getLogger("dloftbs").handlers.clear()
    assert not [warning for warning in recwarn if issubclass(warning.category, ResourceWarning)]


def test_an_unknown_encoding_is_said_once(tmp_path, caplog):
    given = bags.entries(COUNT, info=False)
    for _, _, message in given[1::2]:
        message.encoding = "depth99"
    for _, _, message in given[2::2]:
        message.encoding = "bgr99"
    frames, source = read(bags.write_ros2(tmp_path / "run", given))
    assert ([frame.index for frame in frames], source.skipped) == ([0], COUNT - 1)
    assert len(caplog.records) == 2
    assert caplog.text.count("unknown encoding 'bgr99'") == caplog.text.count("unknown encoding 'depth99'") == 1
    assert len(list(BagSource(tmp_path / "run"))) == 1
    assert caplog.text.count("unknown encoding 'bgr99'") == 2  # each reading says it


def test_video_in_messages_of_images_is_said_once(tmp_path, caplog):
    """The reason says how many bytes there are, which differs from message to message."""
    given = [
        (
            bags.COLOUR_TOPIC,
            bags.stamp_of(i),
            bags.compressed(bytes([0, 0, 0, 1, 101]) * (i + 9), "h264", bags.stamp_of(i)),
        )
        for i in range(COUNT)
    ]
    frames, source = read(bags.write_ros2(tmp_path / "run", given))
    assert (frames, source.skipped, len(caplog.records)) == ([], COUNT, 1)
    assert "a compressed image ('h264') cannot be decoded" in caplog.text


def test_the_transport_that_has_messages_is_taken_where_counts_are_not_known(tmp_path):
    """An unfinished recording of which only the last message is in the other transport, and lost."""
    packed = [
        (f"{bags.COLOUR_TOPIC}/compressed", at, bags.compressed(bags.encoded(bags.photo_of(0), ".png"), "png", at))
        for _, at, _ in bags.entries(COUNT, depth=False, info=False)
    ]
    path = bags.write_mcap(
        tmp_path / "run.mcap", [*packed, *bags.entries(1, depth=False, info=False)], use_chunking=False
    )
    data = path.read_bytes()
    path.write_bytes(data[: data.rindex(b"bgr8") + 99])
    assert len(read(path)[0]) == COUNT
