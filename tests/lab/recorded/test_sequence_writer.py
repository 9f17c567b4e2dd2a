"""Sequences with truth: written, read back bit for bit, and whole whatever ends the writing."""

from __future__ import annotations

import json
import logging
import pickle
import re
from dataclasses import replace

import numpy as np
import pytest
from recorded_examples import SIZE, TinySequence, assert_same_bits, assert_same_truth

from dloftbs.camera import PinholeCamera
from dloftbs.data.frame import Frame
from dloftbs.errors import InputError, SinkError, SourceError
from dloftbs_lab import open_labelled, write_sequence
from dloftbs_lab.recorded import sequence_writer
from dloftbs_lab.recorded.sequence_writer import RECORDS
from dloftbs_lab.synthetic import NOISY, DegradedSequence, Excerpt
from dloftbs_lab.truth import Truth


class OneFrame(TinySequence):
    def __init__(self, frame, truth=None):
        super().__init__(length=1)
        self._one = frame, truth or Truth((), (), ())

    def frame(self, index):
        return self._one[0]

    def truth(self, index):
        return self._one[1]


def read_back(sequence, folder):
    return open_labelled(write_sequence(sequence, folder))


def assert_same_frame(got: Frame, wanted: Frame) -> None:
    for name in ("image", "mask", "depth", "occluders"):
        assert_same_bits(getattr(got, name), getattr(wanted, name))
    assert (got.camera, got.index, got.stamp, got.name) == (wanted.camera, wanted.index, wanted.stamp, wanted.name)


@pytest.mark.parametrize("mask", [None, np.bool_, np.uint8, np.uint16, np.int32], ids=str)
@pytest.mark.parametrize("depth", [None, np.float32, np.float64, np.uint16, np.int16], ids=str)
def test_everything_comes_back_bit_for_bit(tmp_path, mask, depth):
    sequence = TinySequence(2, mask, depth)
    with read_back(sequence, tmp_path / "new" / "folder") as back:
        assert (back.name, back.fps, len(back)) == ("tiny", 12.5, 2)
        for index in range(2):
            assert_same_frame(back.frame(index), sequence.frame(index))
            assert_same_truth(back.truth(index), sequence.truth(index))


@pytest.mark.parametrize("kind", [np.bool_, np.uint8, np.int32], ids=str)
def test_occluders_come_back(tmp_path, kind):
    occluders = np.zeros(SIZE, kind)
    occluders[2:5] = 1
    frame = Frame(mask=np.zeros(SIZE, bool), occluders=occluders)
    assert_same_frame(read_back(OneFrame(frame), tmp_path).frame(0), frame)


@pytest.mark.parametrize("grippers", [[], [[0.1, -0.2, 1.0 / 3.0, 0.05], [0.0, 0.0, 0.7, 0.0]]])
def test_instances_and_grippers_come_back(tmp_path, grippers):
    instances = np.arange(np.prod(SIZE)).reshape(SIZE).astype(np.uint16) % 700
    frame = Frame(mask=instances > 3, instances=instances, grippers=np.reshape(grippers, (-1, 4)))
    back = read_back(OneFrame(frame), tmp_path).frame(0)
    assert_same_frame(back, frame)
    assert_same_bits(back.instances, frame.instances)
    assert_same_bits(back.grippers, frame.grippers)


@pytest.mark.parametrize("unit_m", [1e-4, 1e-3, 2.5e-4])
def test_the_unit_of_depth_comes_back(tmp_path, unit_m):
    frame = Frame(mask=np.zeros(SIZE, bool), depth=np.full(SIZE, 7531, np.uint16), depth_unit_m=unit_m)
    assert read_back(OneFrame(frame), tmp_path).frame(0).depth_unit_m == unit_m


@pytest.mark.parametrize(
    ("mask", "kind"),
    [
        (np.linspace(0.0, 1.0, np.prod(SIZE)).reshape(SIZE), "auto"),
        (np.arange(np.prod(SIZE), dtype=np.uint8).reshape(SIZE), "probability"),
        (np.arange(np.prod(SIZE), dtype=np.uint8).reshape(SIZE), "binary"),
        (np.arange(np.prod(SIZE)).reshape(SIZE).astype(np.uint16) % 3, "labels"),
    ],
)
def test_what_the_values_of_a_mask_are_comes_back(tmp_path, mask, kind):
    frame = Frame(mask=mask, mask_is=kind)
    back = read_back(OneFrame(frame), tmp_path).frame(0)
    assert back.mask_is == frame.mask_is
    assert_same_bits(back.mask, frame.mask)
    assert_same_bits(back.instances, frame.instances)


def test_frames_of_before_units_were_written_are_in_millimetres(tmp_path):
    write_sequence(TinySequence(1), tmp_path)
    records = tmp_path / RECORDS
    record = json.loads(records.read_text())
    del record["depth_unit_m"], record["mask_is"]
    records.write_text(json.dumps(record) + "\n")
    frame = open_labelled(tmp_path).frame(0)
    assert (frame.depth_unit_m, frame.mask_is) == (0.001, "auto")


def test_frames_without_images_come_back(tmp_path):
    assert read_back(TinySequence(1, images=False), tmp_path).frame(0).image is None


@pytest.mark.parametrize("kind", [np.float32, np.float64])
def test_whole_millimetres_are_16_bit_images(tmp_path, kind):
    depth = (np.arange(np.prod(SIZE)).reshape(SIZE) * 47 / 1000).astype(kind)
    frame = Frame(mask=np.zeros(SIZE, bool), depth=np.minimum(depth, kind(65)))
    assert_same_bits(read_back(OneFrame(frame), tmp_path).frame(0).depth, frame.depth)
    assert [path.name for path in (tmp_path / "depth").iterdir()] == ["000000.png"]


@pytest.mark.parametrize("value", [np.nan, np.inf, -1.0, -0.0, 65.536, 0.0005], ids=str)
def test_depth_that_millimetres_would_spoil_comes_back_too(tmp_path, value):
    depth = np.full(SIZE, 0.5, np.float32)
    depth[3, 4] = value
    frame = Frame(mask=np.zeros(SIZE, bool), depth=depth)
    assert_same_bits(read_back(OneFrame(frame), tmp_path).frame(0).depth, depth)


@pytest.mark.parametrize("count", [255, 300])
def test_many_objects_and_hidden_ones_come_back(tmp_path, count):
    masks = np.zeros((count, *SIZE), np.bool_)
    masks.reshape(count, -1)[np.arange(1, count), np.arange(1, count)] = True
    truth = Truth((), tuple(masks), tuple(range(count)))
    assert_same_truth(read_back(OneFrame(Frame(mask=masks[0]), truth), tmp_path).truth(0), truth)


def test_an_empty_sequence_comes_back(tmp_path):
    assert len(read_back(TinySequence(0), tmp_path)) == 0


def test_any_order_and_pickling_give_the_same(tmp_path):
    sequence = TinySequence(4)
    back = read_back(sequence, tmp_path)
    copy = pickle.loads(pickle.dumps(back))
    for index in (3, 0, 2, 2, 1):
        assert_same_frame(copy.frame(index), sequence.frame(index))
        assert_same_truth(back.truth(index), sequence.truth(index))
    assert [frame.name for frame in back] == [frame.name for frame in sequence]


@pytest.mark.parametrize("index", [-1, 4, 1.0, "0"])
def test_a_frame_that_is_not_there_is_refused(tmp_path, index):
    back = read_back(TinySequence(4), tmp_path)
    for get in (back.frame, back.truth):
        with pytest.raises(InputError, match="has the frames 0 to 3"):
            get(index)


def test_a_closed_sequence_gives_nothing(tmp_path):
    with read_back(TinySequence(1), tmp_path) as back:
        pass
    with pytest.raises(SourceError, match="is closed"):
        back.frame(0)


class Smooth(TinySequence):
    """Pictures that a video keeps nearly as they are."""

    def frame(self, index):
        frame = super().frame(index)
        image = np.full((*SIZE, 3), 40 * index, np.uint8)
        return replace(frame, image=image)


def test_a_video_takes_the_place_of_the_images(tmp_path):
    sequence = Smooth(6)
    write_sequence(sequence, tmp_path, video=True)
    assert not (tmp_path / "images").exists()
    with open_labelled(tmp_path) as back:
        assert len(back) == 6
        for source in (back, pickle.loads(pickle.dumps(back))):
            for index in (0, 1, 5, 2, 4, 3, 3):
                frame, wanted = source.frame(index), sequence.frame(index)
                assert frame.image.shape == wanted.image.shape
                assert abs(np.median(frame.image.astype(int)) - 40 * index) <= 4
                assert_same_bits(frame.depth, wanted.depth)
                assert_same_bits(frame.mask, wanted.mask)
                assert_same_truth(source.truth(index), sequence.truth(index))
            source.close()


def test_pictures_of_a_video_are_the_same_in_any_order(tmp_path):
    write_sequence(TinySequence(5), tmp_path, video=True)
    with open_labelled(tmp_path) as forwards, open_labelled(tmp_path) as backwards:
        images = [frame.image for frame in forwards]
        for index in reversed(range(5)):
            assert_same_bits(backwards.frame(index).image, images[index])


def test_a_video_needs_images(tmp_path):
    with pytest.raises(InputError, match=re.escape("frame 0 has no image")):
        write_sequence(TinySequence(1, images=False), tmp_path, video=True)


def test_a_video_needs_one_size(tmp_path):
    class Growing(TinySequence):
        def frame(self, index):
            return Frame(image=np.zeros((20 + index, 30, 3), np.uint8))

        def truth(self, index):
            return Truth((), (), ())

    with pytest.raises(InputError, match=re.escape("frame 1 must have the first one's size (20, 30)")):
        write_sequence(Growing(2), tmp_path, video=True)


@pytest.mark.parametrize("video", [False, True])
def test_what_was_written_before_an_interruption_is_readable(tmp_path, caplog, video):
    sequence = TinySequence(9, stop=4)
    with pytest.raises(KeyboardInterrupt):
        write_sequence(sequence, tmp_path, video=video)
    with caplog.at_level(logging.WARNING, "dloftbs.sources"), open_labelled(tmp_path) as back:
        assert len(back) == 4
        assert "holds 4 of 9 frames" in caplog.text
        assert_same_bits(back.frame(3).depth, sequence.frame(3).depth)
        assert_same_truth(back.truth(3), sequence.truth(3))


def test_a_line_that_a_killed_writer_left_half_is_no_frame(tmp_path):
    write_sequence(TinySequence(3), tmp_path)
    records = tmp_path / "truth.jsonl"
    records.write_bytes(records.read_bytes()[:-9])
    assert len(open_labelled(tmp_path)) == 2


def test_a_video_that_a_killed_writer_cut_off_ends_the_sequence(tmp_path, caplog):
    write_sequence(TinySequence(8), tmp_path, video=True)
    video = tmp_path / "images.mp4"
    data = video.read_bytes()
    video.write_bytes(data[: data.rindex(b"moof") + 10])
    with caplog.at_level(logging.WARNING), open_labelled(tmp_path) as back:
        assert "of 8 frames" in caplog.text
        assert 6 <= len(back) < 8
        assert len(list(back)) == len(back)


def test_nothing_written_is_no_sequence(tmp_path):
    with pytest.raises(KeyboardInterrupt):
        write_sequence(TinySequence(9, stop=0), tmp_path)
    with pytest.raises(SourceError, match="holds none of its 9 frames; its writing was interrupted"):
        open_labelled(tmp_path)


def test_an_older_sequence_is_replaced(tmp_path):
    write_sequence(TinySequence(4), tmp_path, video=True)
    with read_back(TinySequence(2, np.uint8, np.float64), tmp_path) as back:
        assert len(back) == 2
        assert_same_frame(back.frame(1), TinySequence(2, np.uint8, np.float64).frame(1))


def test_an_interrupted_rewrite_never_mixes_old_and_new(tmp_path):
    write_sequence(TinySequence(6, np.uint8), tmp_path)
    with pytest.raises(KeyboardInterrupt):
        write_sequence(TinySequence(6, np.uint16, stop=2), tmp_path)
    assert [frame.mask.dtype for frame in open_labelled(tmp_path)] == [np.uint16, np.uint16]


def test_a_rewrite_that_is_killed_in_its_first_frame_leaves_no_mixture(tmp_path, monkeypatch):
    write_sequence(TinySequence(3, np.uint8), tmp_path)

    def killed(root, index, frame, truth):
        raise KeyboardInterrupt

    monkeypatch.setattr(sequence_writer, "_write_visible", killed)  # when the mask is there, and no line yet
    with pytest.raises(KeyboardInterrupt):
        write_sequence(TinySequence(3, np.uint16), tmp_path)
    with pytest.raises(SourceError, match="holds none of its 3 frames"):
        open_labelled(tmp_path)


def test_the_truth_is_emptied_before_another_file_is_replaced(tmp_path, monkeypatch):
    write_sequence(TinySequence(3), tmp_path)
    monkeypatch.setattr(sequence_writer, "write_whole", lambda path, data: emptied.append((tmp_path / RECORDS).stat()))
    emptied = []
    write_sequence(TinySequence(3), tmp_path)
    assert [found.st_size for found in emptied] == [0]


@pytest.mark.parametrize("video", [False, True])
@pytest.mark.parametrize(
    "changed", [lambda known: known, lambda known: DegradedSequence(known, NOISY), lambda known: Excerpt(known, 0, 2)]
)
def test_a_sequence_is_not_written_into_the_folder_that_it_is_read_from(tmp_path, video, changed):
    write_sequence(TinySequence(3), tmp_path / "data")
    (tmp_path / "link").symlink_to("data")
    before = {path: path.read_bytes() for path in tmp_path.rglob("*.*") if path.is_file()}
    with open_labelled(tmp_path / "data") as known, pytest.raises(InputError, match="is read from"):
        write_sequence(changed(known), tmp_path / "link", video=video)
    assert {path: path.read_bytes() for path in tmp_path.rglob("*.*") if path.is_file()} == before


def test_masks_that_overlap_are_refused(tmp_path):
    mask = np.ones(SIZE, np.bool_)
    with pytest.raises(InputError, match="visible masks of frame 0 overlap"):
        write_sequence(OneFrame(Frame(mask=mask), Truth((), (mask, mask), (1, 2))), tmp_path)


def test_masks_of_another_size_are_refused(tmp_path):
    mask = np.ones(SIZE, np.bool_)
    with pytest.raises(InputError, match=re.escape("must have its size (31, 45), got (30, 45)")):
        write_sequence(OneFrame(Frame(mask=mask), Truth((), (mask[1:],), (1,))), tmp_path)


def test_a_folder_that_cannot_be_made_is_a_sink_error(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(SinkError, match="cannot write"):
        write_sequence(TinySequence(1), tmp_path / "file" / "folder")


def change_record(folder, line, **fields):
    path = folder / "truth.jsonl"
    records = [json.loads(text) for text in path.read_text().splitlines()]
    records[line].update(fields)
    path.write_text("".join(json.dumps(record) + "\n" for record in records))


@pytest.mark.parametrize(
    ("fields", "message"),
    [
        ({"truth": {"ids": [1], "curves": []}}, "frame 1: a truth needs the key 'curves_3d'"),
        ({"truth": 3}, "truth.jsonl, line 2: Expected `object`, got `int` - at `$.truth`"),
        ({"visible": "visible/none.png"}, "none.png: cannot be read"),
        ({"visible": "sequence.json"}, "sequence.json: cannot be decoded as an image"),
    ],
)
def test_corrupt_truth_is_named(tmp_path, fields, message):
    write_sequence(TinySequence(3), tmp_path)
    change_record(tmp_path, 1, **fields)
    back = open_labelled(tmp_path)
    with pytest.raises(SourceError, match=re.escape(message)):
        back.truth(1)
    back.truth(2)


@pytest.mark.parametrize(
    ("fields", "message"),
    [
        ({"camera": {"fx": 1}}, "frame 1: a camera needs fx, fy, cx and cy; missing: fy, cx, cy"),
        ({"camera": {"fx": -1, "fy": 1, "cx": 1, "cy": 1}}, "frame 1: focal lengths must be positive"),
        ({"image": "images/none.png"}, "none.png: cannot be read"),
        ({"mask": {"file": "masks/none.npy", "type": "|b1"}}, "none.npy: cannot be read as a .npy file"),
        ({"depth": {"file": "masks/000001.png", "type": "metres"}}, "masks/000001.png: its type must be such as"),
        ({"mask": {"file": "images/000001.png", "type": "|u1"}}, "frame 1: mask must have shape"),
    ],
)
def test_a_corrupt_frame_is_named(tmp_path, fields, message):
    write_sequence(TinySequence(3), tmp_path)
    change_record(tmp_path, 1, **fields)
    with pytest.raises(SourceError, match=re.escape(message)):
        open_labelled(tmp_path).frame(1)


def test_a_line_that_is_no_json_is_named(tmp_path):
    write_sequence(TinySequence(2), tmp_path)
    records = tmp_path / "truth.jsonl"
    records.write_bytes(records.read_bytes().replace(b"{", b"<", 1))
    with pytest.raises(SourceError, match=re.escape("truth.jsonl, line 1: ")):
        open_labelled(tmp_path).truth(0)


def test_another_format_is_refused(tmp_path):
    write_sequence(TinySequence(2), tmp_path)
    header = tmp_path / "sequence.json"
    header.write_text(header.read_text().replace("sequence 1", "sequence 2"))
    with pytest.raises(SourceError, match=re.escape("sequence.json: Invalid enum value 'dloftbs sequence 2'")):
        open_labelled(tmp_path)


def test_a_lost_list_of_frames_is_named(tmp_path):
    write_sequence(TinySequence(2), tmp_path)
    (tmp_path / "truth.jsonl").unlink()
    with pytest.raises(SourceError, match=re.escape("truth.jsonl: cannot be read")):
        open_labelled(tmp_path)


@pytest.mark.parametrize("model", ["polynomial", "fisheye"])
def test_lens_and_size_of_the_camera_come_back(tmp_path, model):
    class WithLens(TinySequence):
        def frame(self, index):
            return replace(super().frame(index), camera=camera)

    camera = PinholeCamera(512.25, 511.1, 22.3, 15.7, (-0.1, 1 / 3, 1e-17, 0.002), model, SIZE)
    assert read_back(WithLens(1), tmp_path).frame(0).camera == camera
