import pickle

import cv2
import numpy as np
import pytest

from dloftbs.errors import InputError, SourceError
from dloftbs.evaluation.suites import SUITES, missing_for, open_suite

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
    monkeypatch.setattr("dloftbs.synthetic.simulation_available", lambda: False)
    assert [name for name in SUITES if missing_for(name) is not None] == ["simulated"]
    with pytest.raises(InputError, match=r"pip install 'dloftbs\[evaluation\]'"):
        open_suite("simulated", **TINY)


def test_a_scale_of_nothing_is_an_error():
    with pytest.raises(InputError, match="scale > 0"):
        open_suite("rgb", scale=0.0)
