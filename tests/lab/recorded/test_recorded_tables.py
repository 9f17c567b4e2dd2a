"""Tables of splines, as the authors of DLOFTBs write them and plain, beside videos and images."""

from __future__ import annotations

import json
import logging
import pickle
import re

import numpy as np
import pytest
from recorded_examples import CAMERA, SIZE, TinySequence, assert_same_bits, picture, save

from dloftbs import sources
from dloftbs.errors import SourceError
from dloftbs_lab import open_labelled, write_sequence
from dloftbs_lab.recorded.through_points import curve_through

AUTHORS = ",control_points_x,control_points_y,control_points_z,points_on_curve_x,points_on_curve_y,points_on_curve_z"


def points(frame, count=256):
    t = np.linspace(0.0, 1.0, count)
    return np.stack((3 + 37 * t, 9 + frame + 5 * np.sin(6 * t), 540 + 90 * t), axis=1)


def authors_table(frames, *, name=None, z=True, text=lambda values: str(values.tolist())):
    """Return a table as the authors' code writes it: each list a quoted field."""
    axes = (0, 1, 2) if z else (0, 1)
    head = [f"{kind}_{'xyz'[axis]}" for kind in ("control_points", "points_on_curve") for axis in axes]
    lines = ["," + ",".join((["image_filename"] if name else []) + head)]
    for frame in frames:
        lists = [points(frame, 25)[:, axis] for axis in axes] + [points(frame)[:, axis] for axis in axes]
        lines.append(
            ",".join([str(frame), *([name(frame)] if name else []), *(f'"{text(values)}"' for values in lists)])
        )
    return "\n".join(lines) + "\n"


def plain_table(frames, z=False):
    lines = ["frame,object,i,x,y" + (",z" if z else "")]
    for frame in frames:
        for number in (2, 1):
            rows = [(f"{x},{y + number}" + (f",{d / 1000}" if z else "")) for x, y, d in points(frame, 9)]
            lines += [f"{frame},{number},{i},{row}" for i, row in reversed(list(enumerate(rows)))]
    return "\n".join(lines) + "\n"


def images(folder, names=("0.png", "1.png", "2.png")):
    for number, name in enumerate(names):
        save(folder / name, picture(number))


def write(folder, text):
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "spline.csv").write_text(text)
    return folder


@pytest.fixture
def video(tmp_path):
    """Return a folder with a video of six frames."""
    write_sequence(TinySequence(6), tmp_path / "source", video=True)
    folder = tmp_path / "recorded"
    folder.mkdir()
    (tmp_path / "source" / "images.mp4").rename(folder / "cable.mp4")
    return folder


def test_the_helper_writes_the_columns_of_the_authors_file():
    assert authors_table([0]).splitlines()[0] == AUTHORS


def test_the_authors_table_beside_images(tmp_path):
    images(tmp_path)
    with open_labelled(write(tmp_path, authors_table(range(3))), "spline tables") as sequence:
        assert len(sequence) == 3
        for index in (2, 0, 1):
            truth = sequence.truth(index)
            assert_same_bits(sequence.frame(index).image, picture(index))
            assert truth.curves == (curve_through(points(index)[:, :2]),)
            assert (truth.ids, truth.curves_3d, truth.visible_masks) == ((1,), (), ())


def test_the_authors_depth_is_in_millimetres(tmp_path):
    images(tmp_path)
    write(tmp_path, authors_table(range(3)))
    camera = {name: getattr(CAMERA, name) for name in ("fx", "fy", "cx", "cy")}
    (tmp_path / "camera.json").write_text(json.dumps(camera))
    truth = open_labelled(tmp_path).truth(1)
    np.testing.assert_allclose(truth.curves_3d[0]([0.0, 1.0])[:, 2], (0.54, 0.63))
    np.testing.assert_allclose(CAMERA.project(truth.curves_3d[0](0.0)), points(1)[0, :2])


def test_the_authors_older_table_has_rows_for_x(tmp_path):
    images(tmp_path)
    table = authors_table(range(3), z=False)
    truth = open_labelled(write(tmp_path, table)).truth(0)
    assert truth.curves == (curve_through(points(0)[:, 1::-1]),)


def test_lists_may_be_as_numpy_prints_them(tmp_path):
    images(tmp_path)
    write(tmp_path, authors_table(range(3), text=str))
    curve = open_labelled(tmp_path).truth(2).curves[0]
    np.testing.assert_allclose(curve.sample(50), curve_through(points(2)[:, :2]).sample(50), atol=1e-4)


def test_frames_by_the_names_of_images_in_a_folder_of_their_own(tmp_path, caplog):
    images(tmp_path / "wire", ["a.png", "b.png", "c.png"])
    images(tmp_path / "spline", ["a.png", "c.png"])
    table = authors_table(range(2), name=lambda frame: "ca"[frame] + ".png")
    with caplog.at_level(logging.WARNING, "dloftbs.sources"):
        sequence = open_labelled(write(tmp_path, table))
    assert [frame.name for frame in sequence] == ["c.png", "a.png"]
    assert "left out 1 frames" in caplog.text


@pytest.mark.parametrize("table", [authors_table([4, 1]), plain_table([4, 1])], ids=["authors", "plain"])
def test_frames_of_a_video(video, table, caplog):
    write(video, table)
    with caplog.at_level(logging.WARNING, "dloftbs.sources"), open_labelled(video) as sequence:
        assert "left out 4 frames" in caplog.text
        assert [frame.name for frame in sequence] == ["cable.mp4#1", "cable.mp4#4"]
        assert sequence.fps == 12.5
        with sources.open(video / "cable.mp4") as whole, pickle.loads(pickle.dumps(sequence)) as copy:
            wanted = [frame.image for frame in whole]
            assert_same_bits(copy.frame(1).image, wanted[4])
            assert_same_bits(copy.frame(0).image, wanted[1])


def test_points_of_several_objects_in_any_order(tmp_path):
    images(tmp_path)
    truth = open_labelled(write(tmp_path, plain_table(range(3)))).truth(1)
    assert truth.ids == (1, 2)
    assert truth.curves == tuple(curve_through(points(1, 9)[:, :2] + (0, number)) for number in truth.ids)


def test_depth_in_metres_beside_points(tmp_path):
    images(tmp_path)
    write(tmp_path, plain_table(range(3), z=True))
    (tmp_path / "camera.json").write_text('{"fx": 500, "fy": 500, "cx": 20, "cy": 15}')
    truth = open_labelled(tmp_path).truth(0)
    np.testing.assert_allclose([curve(1.0)[2] for curve in truth.curves_3d], 0.63)


@pytest.mark.parametrize(
    ("table", "message"),
    [
        (authors_table([0, 3]), "line 3: frame 3 is none of the 3 there"),
        (plain_table([-1]), "line 2: frame -1 is none of the 3 there"),
        (authors_table([0, 0]), "line 3: frame 0 comes a second time"),
        (authors_table([]), "spline.csv: has no rows"),
        (authors_table([0], name=lambda _: "x.png"), "line 2: there is no image 'x.png'"),
        (authors_table([0], text=lambda _: "1, 2"), "line 2: points_on_curve_x must be a list of numbers in brackets"),
        (authors_table([0], text=lambda _: "[1, ...]"), "line 2: points_on_curve_x must be a list of numbers"),
        (authors_table([0], text=lambda v: str(v[: int(v[0])].tolist())), "line 2: the lists differ in length: ["),
        ("frame,object,i,x,y\n0,1,0,1,1\n0,1,1,no,1\n", "line 3: x must be a number, got 'no'"),
        ("frame,object,i,x,y\n0.5,1,0,1,1\n", "line 2: frame must be a whole number, got '0.5'"),
        ("frame,object,i,x,y\n0,1,0,1\n", "line 2: has 4 fields instead of 5"),
    ],
)
def test_corrupt_tables_are_named(tmp_path, table, message):
    images(tmp_path)
    with pytest.raises(SourceError, match=re.escape(message)):
        open_labelled(write(tmp_path, table))


def test_points_that_make_no_curve_are_named(tmp_path):
    images(tmp_path)
    write(tmp_path, "frame,object,i,x,y\n0,1,0,1,1\n0,1,1,2,2\n1,1,0,3,3\n")
    sequence = open_labelled(tmp_path)
    sequence.truth(0)
    with pytest.raises(SourceError, match=re.escape("spline.csv, line 4: a curve needs 2 points")):
        sequence.truth(1)


def test_a_table_without_pictures_says_what_it_needs(tmp_path):
    with pytest.raises(SourceError, match=re.escape("needs one video (.mp4, ") + ".*found none"):
        open_labelled(write(tmp_path, authors_table([0])))


def test_two_sets_of_pictures_are_not_guessed_at(video):
    images(video / "frames")
    with pytest.raises(SourceError, match=re.escape("found cable.mp4, frames")):
        open_labelled(write(video, authors_table([0])))


def test_two_tables_are_not_guessed_at(tmp_path):
    images(write(tmp_path, authors_table([0])))
    (tmp_path / "other.csv").write_text(plain_table([0]))
    with pytest.raises(SourceError, match=re.escape("needs one table of splines, found other.csv, spline.csv")):
        open_labelled(tmp_path)


def test_a_video_that_cannot_be_opened_is_named(tmp_path):
    write(tmp_path, authors_table([0]))
    (tmp_path / "cable.mp4").write_bytes(b"no video")
    with pytest.raises(SourceError, match=re.escape("cable.mp4: cannot be opened as a video")):
        open_labelled(tmp_path)


def test_a_video_that_is_cut_off_later_is_named(video):
    sequence = open_labelled(write(video, plain_table([5])))
    data = (video / "cable.mp4").read_bytes()
    (video / "cable.mp4").write_bytes(data[: len(data) // 2])
    with pytest.raises(SourceError, match=r"cable\.mp4: has no picture 5; \d could be decoded"):
        sequence.frame(0)


def test_other_tables_are_left_alone(tmp_path):
    images(tmp_path)
    (tmp_path / "times.csv").write_bytes(b"\xff\xfe\x00")
    assert open_labelled(write(tmp_path, plain_table(range(3)))).frame(0).size == SIZE
