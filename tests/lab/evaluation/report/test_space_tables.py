import functools

import numpy as np
import pytest
from lab.evaluation import runner_stubs as stubs

from dloftbs_lab.evaluation.report.all_tables import tables
from dloftbs_lab.evaluation.report.plots import write_plots
from dloftbs_lab.evaluation.runner.run import evaluate
from dloftbs_lab.evaluation.runner.sequence_run import Method
from dloftbs_lab.evaluation.suites import Suite
from dloftbs_lab.synthetic import DepthCameraSequence, rgbd_noisy

SIZE = (180, 320)
SCALE = 0.115  # 8 frames of each


class Knowing:
    """Knows the axes of one sequence, and moves them away from the camera, some frames further than the others."""

    def __init__(self, number, shift_mm=0.0, stretch=0.0, lost=(), far=()):
        self.number, self.shift_mm, self.stretch, self.lost, self.far = number, shift_mm, stretch, lost, far
        self.sequence = rgbd_noisy(SCALE, 0, SIZE)[number]

    def __call__(self, frame):
        (axis,) = self.sequence.truth(frame.index).curves_3d
        if frame.index in self.lost:
            return self.sequence.truth(frame.index).curves
        shift_m = 1e-3 * (self.shift_mm + 10.0 * (frame.index in self.far))
        middle = axis.sample(100).mean(axis=0)
        scale = 1.0 + self.stretch
        return [axis.transformed(scale * np.eye(3), (1.0 - scale) * middle + np.array([0.0, 0.0, shift_m]))]


def table_of(tmp_path, number, **options):
    sequences = (rgbd_noisy(SCALE, 0, SIZE)[number],)
    suite = Suite("rgbd-noisy", "one of them", sequences, "settings")
    method = Method("knowing", functools.partial(Knowing, number, **options))
    parts = evaluate([suite], [method], tmp_path)
    (table,) = [table for table in tables(parts) if table.name == "rgbd-noisy"]
    return dict(zip(table.columns, table.rows[0], strict=True)), table


def test_perfection_scores_nothing(tmp_path):
    row, table = table_of(tmp_path, 0)
    assert row["scenario"] == "0 high curvature, time of flight, near"
    assert (row["L3 mm mean"], row["L3 mm 95 %"], row["L3 mm max"]) == (0.0, 0.0, 0.0)
    assert (row["length off, % mean"], row["length off, % median"]) == (0.0, 0.0)
    assert (row["frames"], row["frames without a curve in space"]) == (8, 0)
    assert not any("limit" in column for column in table.columns)


def test_lost_frames_count_as_far_off_in_the_quantile_and_are_told(tmp_path):
    row, _ = table_of(tmp_path, 1, lost=(2,))
    assert row["L3 mm mean"] == 0.0  # of those that exist
    assert row["L3 mm 95 %"] is None
    assert row["frames without a curve in space"] == 1


def test_a_length_that_is_off_shows(tmp_path):
    row, _ = table_of(tmp_path, 1, stretch=0.02)
    assert row["length off, % mean"] == pytest.approx(2.0, rel=1e-6)


def test_one_frame_that_is_far_off_is_the_largest(tmp_path):
    row, _ = table_of(tmp_path, 1, far=(2,))
    assert row["L3 mm max"] > 5.0 > row["L3 mm mean"] > 0.0


def test_a_shift_along_the_axis_of_the_camera_shows_as_less_than_itself(tmp_path):
    row, _ = table_of(tmp_path, 13, shift_mm=2.0)
    assert 1.5 < row["L3 mm mean"] <= 2.0


class DepthRung(stubs.Bars):
    def __init__(self, ladder, level):
        super().__init__(f"{ladder} {level}", deep=True)
        self.base, self.ladder, self.level, self.unit = "bars", ladder, level, "sigma"


def test_ladders_of_depth_have_a_plot_of_their_own(tmp_path):
    rungs = [DepthRung(ladder, level) for ladder in ("depth noise", "jitter") for level in (0.0, 1.0)]
    suite = Suite("noise", "ladders", tuple(rungs), "settings")
    parts = evaluate([suite], [stubs.method(stubs.in_space)], tmp_path / "parts")
    names = [path.name for path in write_plots(parts, tmp_path)]
    assert names == ["noise-bars.png", "depth-bars.png", "times.png"]
    (table,) = [table for table in tables(parts) if table.name == "noise"]
    rows = [dict(zip(table.columns, row, strict=True)) for row in table.rows]
    assert [row["L3 mm"] for row in rows] == pytest.approx([10.0] * 4, abs=0.01)
    assert [row["length in space off, %"] for row in rows] == pytest.approx([0.0] * 4, abs=1e-6)


def test_frames_before_a_depth_camera_are_counted_by_its_errors(tmp_path):
    sequences = (DepthCameraSequence("flat", "noise", 2, SIZE, 1), DepthCameraSequence("flat", "holes", 2, SIZE, 1))
    suite = Suite("rgbd-camera", "two of them", sequences, "settings")
    method = Method("off", functools.partial(Off, {"flat, noise": 8.0}))
    (table,) = [table for table in tables(evaluate([suite], [method], tmp_path)) if table.name == "rgbd-camera"]
    noise, holes = (dict(zip(table.columns, row, strict=True)) for row in table.rows)
    assert (noise["errors of depth"], noise["far off"], noise["frames"]) == ("noise", 2, 2)
    assert 5.0 < noise["L3 mm median"] <= 8.0
    assert (holes["errors of depth"], holes["far off"], holes["L3 mm max"]) == ("holes", 0, 0.0)
    assert holes["frames without a curve in space"] == 0


class Off:
    """Returns the truth, moved away by as many millimetres as are given for a sequence."""

    def __init__(self, by_mm):
        self.by_mm = by_mm

    def __call__(self, frame):
        name = frame.name.partition("#")[0]
        kind, _, errors = name.partition(", ")
        (axis,) = DepthCameraSequence(kind, errors, 2, SIZE, 1).truth(frame.index).curves_3d
        return [axis.transformed(np.eye(3), np.array([0.0, 0.0, 1e-3 * self.by_mm.get(name, 0.0)]))]
