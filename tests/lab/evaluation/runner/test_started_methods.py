"""Methods that are told the truth of the first frame, and methods of which the best of several forms counts."""

import functools

from lab.evaluation import runner_stubs as stubs
from lab.evaluation.following_stubs import Hidden
from lab.evaluation.runner_stubs import Bars, method, suite

from dloftbs.errors import InputError
from dloftbs_lab.evaluation.runner.run import evaluate
from dloftbs_lab.evaluation.runner.sequence_run import Method


class Keeping:
    """Says in every frame what it was told of the first one, shifted."""

    def __init__(self, shift=0.0):
        self.shift, self.curves = shift, None
        self.told = 0

    def start(self, frame, truth):
        assert frame.index == 0
        self.told += 1
        self.curves = [curve.sample(50) + self.shift for curve in truth.curves]

    def __call__(self, frame):
        if self.told != 1:
            raise InputError(f"told {self.told} times")
        return dict(enumerate(self.curves))


class Refusing(Keeping):
    def start(self, frame, truth):
        raise InputError("one cable, please")


def scored(tmp_path, *methods, sequence=None):
    return evaluate([suite(sequence or Bars())], methods, tmp_path)


def test_a_method_with_a_start_is_told_the_first_truth_once(tmp_path):
    (part,) = scored(tmp_path, Method("keeping", Keeping))
    assert [row.failure for row in part.rows] == [None] * 3
    assert part.rows[0].l3_px < 1e-9
    assert [round(row.l3_px, 3) for row in part.rows[1:]] == [1.0, 2.0]


def test_a_start_that_fails_fails_in_every_frame(tmp_path):
    refusing, named = scored(tmp_path, Method("refusing", Refusing), method(stubs.named))
    assert {row.failure for row in refusing.rows} == {"InputError: one cable, please"}
    assert {row.missing for row in refusing.rows} == {2}
    assert {row.failure for row in named.rows} == {None}


def test_a_start_that_leaves_the_process_fails_in_every_frame(tmp_path):
    (part,) = scored(tmp_path, Method("leaves", stubs.LeavesAtTheStart))
    assert {row.failure for row in part.rows} == {"SystemExit: 0"}


def test_what_is_told_the_start_is_not_compared_with_a_frame_alone(tmp_path):
    keeping, named = scored(tmp_path, Method("keeping", Keeping), method(stubs.named), sequence=Hidden())
    assert keeping.following is None
    assert named.following is not None


def test_the_best_of_several_forms_counts(tmp_path):
    forms = [functools.partial(Keeping, shift) for shift in (9.0, 0.5, 4.0)]
    (part,) = scored(tmp_path, Method("best", forms[0], alternatives=tuple(forms[1:])))
    assert 0.0 < part.rows[0].l3_px < 1.0


def test_a_form_that_finds_more_is_better_than_one_that_is_nearer(tmp_path):
    forms = Method("best", stubs.always(stubs.raising), alternatives=(functools.partial(Keeping, 2.0),))
    (part,) = scored(tmp_path, forms)
    assert {row.failure for row in part.rows} == {None}


def test_in_space_the_nearer_in_space_counts(tmp_path):
    deep = Method("best", stubs.always(stubs.nothing), alternatives=(stubs.always(stubs.in_space),))
    (part,) = scored(tmp_path, deep, sequence=Bars(deep=True))
    assert part.rows[0].l3_mm is not None
