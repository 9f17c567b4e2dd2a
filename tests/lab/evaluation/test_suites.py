import os
import pickle
import sys
from pathlib import Path

import cv2
import numpy as np
import pytest

from dloftbs.errors import InputError, SourceError
from dloftbs_lab.evaluation.suites import SUITES, missing_for, open_suite

TINY = {"scale": 0.01, "size": (180, 320)}


@pytest.mark.parametrize("name", SUITES)
def test_every_suite_opens_and_can_be_pickled(name):
    if missing_for(name) is not None:
        pytest.skip(missing_for(name))
    suite = open_suite(name, **TINY)
    assert suite.frames == sum(len(sequence) for sequence in suite.sequences) > 0
    sequence = pickle.loads(pickle.dumps(suite.sequences[-1]))
    frame, truth = sequence.frame(0), sequence.truth(0)
    assert frame.mask is not None
    assert len(truth.curves) == len(truth.ids) > 0
    names = [sequence.name for sequence in suite.sequences]
    assert len(set(names)) == len(names)


FEWER = {"rgbd": 8, "rgbd-artificial": 8}
"""Scenes of a name in the suites that keep the paper's number of frames."""


@pytest.mark.parametrize("name", [name for name in SUITES if name != "several-cables"])
def test_a_figure_is_over_twenty_scenes(name):
    if missing_for(name) is not None:
        pytest.skip(missing_for(name))
    suite = open_suite(name)
    scenes = {}
    for sequence in suite.sequences:
        # What a table has in a row: sequences of a name, without the number; single images are scenes each.
        row = sequence.name.rpartition(", ")[0] if hasattr(sequence, "number") else sequence.name
        images = range(len(sequence)) if sequence.fps is None else [0]
        scenes.setdefault(row, set()).update((sequence.scene_name, i) for i in images)
    assert min(map(len, scenes.values())) >= FEWER.get(name, 20)
    assert not suite.thinned


def test_scenes_differ_and_noise_does_not_make_another_one():
    suite = open_suite("kinds", scale=0.1, size=(180, 320))
    of = {}
    for sequence in suite.sequences:
        of.setdefault(sequence.name, []).append(sequence)
    assert [one.scene_name for one in of["one loop"]] == ["one loop, seed 0", "one loop, seed 1"]
    assert [one.scene_name for one in of["one loop, noisy"]] == ["one loop, seed 0", "one loop, seed 1"]
    first, second = of["one loop"]
    assert first.truth(0).to_dict() != second.truth(0).to_dict()
    noisy = of["one loop, noisy"][1]
    assert noisy.truth(0).to_dict() == second.truth(0).to_dict()


def test_seeds_have_no_scene_in_common():
    shapes = [open_suite("rgb", scale=0.05, seed=seed, size=(180, 320)).sequences[0].truth(0) for seed in (0, 1)]
    assert shapes[0].to_dict() != shapes[1].to_dict()


def test_a_part_of_a_scene_has_fewer_frames():
    assert [len(one) for one in open_suite("kinds", scale=0.02, size=(180, 320)).sequences[:2]] == [5, 5]


def test_the_settings_tell_suites_apart():
    suites = [open_suite("kinds", scale=0.01 + 0.01 * (i == 1), seed=i == 2, size=(180, 320 + i)) for i in range(3)]
    assert len({suite.settings for suite in suites}) == 3


def test_rungs_of_a_ladder_say_where_they_stand():
    sequences = open_suite("noise", **TINY).sequences
    assert len(sequences) > 10
    for sequence in sequences:
        assert isinstance(sequence.ladder, str)
        assert isinstance(sequence.level, float)


def labelled(folder, count=2):
    folder.mkdir(parents=True)
    for i in range(count):
        labels = np.zeros((60, 80), np.uint8)
        labels[20 + i : 25 + i, 5:75] = 1
        cv2.imwrite(str(folder / f"{i:02d}.jpg"), np.repeat(labels[..., None] * 200, 3, axis=2))
        cv2.imwrite(str(folder / f"{i:02d}.labels.png"), labels)


def test_a_folder_is_a_suite(tmp_path):
    labelled(tmp_path / "set")
    suite = open_suite(str(tmp_path / "set"))
    assert (suite.name, suite.frames, [sequence.name for sequence in suite.sequences]) == ("set", 2, ["set"])


def test_a_folder_of_folders_is_a_suite_of_sequences(tmp_path):
    labelled(tmp_path / "sets" / "b")
    labelled(tmp_path / "sets" / "a", count=1)
    (tmp_path / "sets" / "neither").mkdir()
    suite = open_suite(str(tmp_path / "sets"))
    assert (suite.frames, [sequence.name for sequence in suite.sequences]) == (3, ["a", "b"])


def test_a_folder_that_is_not_whole_is_an_error_and_no_other_is_taken_for_it(tmp_path):
    labelled(tmp_path / "sets" / "a")
    labelled(tmp_path / "sets" / "b")
    (tmp_path / "sets" / "b" / "07.labels.png").write_bytes((tmp_path / "sets" / "b" / "00.labels.png").read_bytes())
    with pytest.raises(SourceError, match=r"07\.labels\.png"):
        open_suite(str(tmp_path / "sets"))
    labelled(tmp_path / "sets" / "b" / "old")
    with pytest.raises(SourceError, match=r"07\.labels\.png"):
        open_suite(str(tmp_path / "sets" / "b"))


@pytest.mark.skipif(sys.platform != "linux", reason="names of bytes")
def test_a_name_that_is_no_text_is_a_name(tmp_path):
    labelled(tmp_path / "set")
    Path(os.fsdecode(os.fsencode(tmp_path / "set") + b"/caf\xe9.txt")).write_text("")
    assert open_suite(str(tmp_path / "set")).frames == 2


def test_a_changed_folder_has_other_settings(tmp_path):
    labelled(tmp_path / "set")
    before = open_suite(str(tmp_path / "set")).settings
    (tmp_path / "set" / "more.txt").write_text("new")
    assert open_suite(str(tmp_path / "set")).settings != before


def test_a_folder_without_labels_is_an_error(tmp_path):
    with pytest.raises(SourceError, match="Right are"):
        open_suite(str(tmp_path))


def test_what_is_neither_suite_nor_folder_is_an_error():
    with pytest.raises(InputError, match="no suite and no folder 'rgbb'; the suites are rgbd-artificial, rgbd-noisy,"):
        open_suite("rgbb")


def test_without_mujoco_the_suite_says_how_to_get_it(monkeypatch):
    monkeypatch.setattr("dloftbs_lab.synthetic.simulation_available", lambda: False)
    assert {name for name in SUITES if missing_for(name) is not None} - {"real-motion"} == {"simulated"}
    with pytest.raises(InputError, match=r"pip install 'dloftbs\[evaluation\]'"):
        open_suite("simulated", **TINY)


def test_recordings_are_read_where_they_are_named(shared_data):
    if missing_for(name := f"real-motion:{shared_data / 'motion'}") is not None:
        pytest.skip("needs ../shared/data/motion")
    suite = open_suite(name, **TINY)
    assert (suite.name, suite.sequences[0].family) == ("real-motion", "mask")
    assert ", files " in suite.settings


def test_without_recordings_the_suite_says_where_they_belong(tmp_path):
    with pytest.raises(InputError, match="real-motion:FOLDER"):
        open_suite(f"real-motion:{tmp_path}", **TINY)


def test_a_scale_of_nothing_is_an_error():
    with pytest.raises(InputError, match="scale > 0"):
        open_suite("rgb", scale=0.0)
