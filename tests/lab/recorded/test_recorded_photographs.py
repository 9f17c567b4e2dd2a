"""The photographs of Ariadne and of mBEST: tiny folders in their formats, and the real ones where they are at hand."""

from __future__ import annotations

import logging

import cv2
import numpy as np
import pytest
from recorded_examples import save

from dloftbs.errors import InputError, SourceError
from dloftbs_lab import open_labelled
from dloftbs_lab.evaluation.suites import open_suite

SIZE = (60, 90)
LINES = "3 5 10 40 12 80 10\n2 5 40 80 42\n"


def fill(folder, stem="00004", lines=LINES):
    mask = np.zeros(SIZE, np.uint8)
    mask[8:14, 5:81] = mask[38:44, 5:81] = 255
    save(folder / f"{stem}.jpg", np.repeat(mask[..., None], 3, axis=2) // 2)
    save(folder / f"{stem}_mask_all.png", mask)
    save(folder / f"{stem}_mask_0.png", mask * (np.indices(SIZE)[0] < 20))
    (folder / f"{stem}.txt").write_text(lines)
    return folder


def test_ariadnes_points_are_curves_and_the_mask_is_that_of_all_cables(tmp_path):
    sequence = open_labelled(fill(fill(tmp_path), "00015", lines="2 1 2 3 4\n\n"))
    assert (len(sequence), sequence.tolerance_px) == (2, 10.0)
    frame, truth = sequence.frame(0), sequence.truth(0)
    assert (frame.name, frame.image.shape, int(frame.mask.astype(bool).sum())) == ("00004.jpg", (*SIZE, 3), 2 * 6 * 76)
    assert (truth.ids, truth.visible_masks) == ((1, 2), ())
    np.testing.assert_allclose(truth.curves[0]([0.0, 1.0]), [[5, 10], [80, 10]], atol=1e-9)
    np.testing.assert_allclose(truth.curves[1](0.5), [42.5, 41.0], atol=1e-9)
    assert len(sequence.truth(1).curves) == 1


@pytest.mark.parametrize("lines", ["3 5 10 40 12\n", "1 5 10\n", "x 1 2 3 4\n", "2 1 2 nan 4\n", "2 1 2 1 2\n"])
def test_wrong_points_are_named(tmp_path, lines):
    with pytest.raises(SourceError, match=r"00004\.txt: "):
        open_labelled(fill(tmp_path, lines=lines)).truth(0)


def test_points_that_are_missing_are_named(tmp_path):
    (fill(tmp_path) / "00004.txt").unlink()
    with pytest.raises(SourceError, match=r"00004\.txt: .*No such file"):
        open_labelled(tmp_path).truth(0)


def test_a_photograph_without_mask_is_left_out_and_said(tmp_path, caplog):
    save(fill(tmp_path) / "00005.jpg", np.zeros((*SIZE, 3), np.uint8))
    with caplog.at_level(logging.WARNING, "dloftbs.sources"):
        assert len(open_labelled(tmp_path)) == 1
    assert "00005.jpg" in caplog.text


def test_two_photographs_of_one_stem_are_an_error(tmp_path):
    save(fill(tmp_path) / "00004.bmp", np.zeros((*SIZE, 3), np.uint8))
    with pytest.raises(SourceError, match=r"got 00004\.bmp and 00004\.jpg"):
        open_labelled(tmp_path)


def test_mbests_masks_are_by_colour(tmp_path):
    hsv = np.zeros((*SIZE, 3), np.uint8)
    hsv[:] = (140, 200, 200)
    for row, colour in (
        (5, (10, 90, 200)),
        (15, (170, 90, 200)),
        (25, (40, 90, 200)),
        (35, (100, 90, 60)),
        (45, (10, 90, 60)),
    ):
        hsv[row : row + 5, 10:80] = colour
    labels = np.zeros(SIZE, np.uint8)
    labels[5:10, 10:80] = 1
    save(tmp_path / "00.png", cv2.cvtColor(hsv, cv2.COLOR_HSV2BGR))
    save(tmp_path / "00.labels.png", labels)
    by_colour = open_labelled(tmp_path, "mbest")
    expected = np.zeros(SIZE, bool)
    for row in (5, 15, 25, 35):
        expected[row : row + 5, 10:80] = True
    np.testing.assert_array_equal(by_colour.frame(0).mask, expected)
    np.testing.assert_array_equal(by_colour.truth(0).mask, labels > 0)
    np.testing.assert_array_equal(open_labelled(tmp_path).frame(0).mask, labels > 0)


def test_a_suite_can_say_its_layout_and_tolerance(tmp_path):
    fill(tmp_path)
    suite = open_suite(f"ariadne:{tmp_path}", tolerance_px=4.0)
    assert suite.sequences[0].tolerance_px == 4.0
    assert suite.settings.endswith("layout ariadne, tolerance 4 px")
    assert open_suite(str(tmp_path)).sequences[0].tolerance_px == 10.0
    with pytest.raises(SourceError, match="It looks like the layout ariadne"):
        open_suite(f"mbest:{tmp_path}")
    with pytest.raises(InputError, match="tolerance_px must be positive"):
        open_suite(str(tmp_path), tolerance_px=0.0)


def test_the_real_photographs_of_ariadne(shared_data):
    sequence = open_labelled(shared_data / "cables")
    assert len(sequence) == 10
    assert [len(sequence.truth(index).curves) for index in range(10)] == [8, 8, 8, 8, 9, 6, 6, 9, 7, 6]
    points = np.concatenate([curve.sample(50) for curve in sequence.truth(0).curves])
    columns, rows = np.rint(points).astype(int).T
    assert (sequence.frame(0).mask[rows, columns] > 0).mean() > 0.95


def test_the_real_photographs_of_mbest(shared_data):
    sequence = open_labelled(shared_data / "mbest" / "S3", "mbest")
    assert len(sequence) == 30
    mask, true = sequence.frame(0).mask, sequence.truth(0).mask
    assert sequence.truth(0).ids == (1, 2, 3)
    assert (mask & true).sum() / (mask | true).sum() > 0.99
