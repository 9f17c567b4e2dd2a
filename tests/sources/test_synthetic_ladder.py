import pickle

import numpy as np
import pytest

from dloftbs.errors import InputError
from dloftbs.sources.synthetic import LADDER_BASES, KindSequence, LadderBase, noise_ladder

SIZE = (180, 320)
CALM = {
    "calm": LadderBase(
        lambda frames, size, seed: KindSequence("rapid moves 1", frames, size, seed),
        lambda frames, size, seed, width_px: KindSequence("rapid moves 1", frames, size, seed, width_px),
    )
}
LEVELS = {
    "salt and pepper": [0, 0.1, 0.3, 0.5, 1, 2],
    "edge jitter": [0, 0.5, 1, 2],
    "missing stretches": [0, 5, 10, 20],
    "width": [2, 4, 8, 12, 20, 40],
    "size": [320, 640, 1280, 1920, 3840],
}


def levels(rungs):
    found = {}
    for rung in rungs:
        found.setdefault(rung.ladder, []).append(rung.level)
    return found


def test_ladders_have_their_rungs():
    rungs = noise_ladder(0.01, 0, SIZE, bases=CALM)
    assert levels(rungs) == LEVELS
    assert all(len(rung) == 3 for rung in rungs)
    assert rungs[2].name == "calm, salt and pepper 0.3 %"
    assert rungs[7].name == "calm, edge jitter 0.5 px"
    assert {rung.base for rung in rungs} == {"calm"}
    assert all(len(rung) == 10 for rung in noise_ladder(bases=CALM))


def test_every_suite_has_its_ladder():
    rungs = noise_ladder(0.01, 0, SIZE)
    for base in LADDER_BASES:
        found = levels([rung for rung in rungs if rung.base == base])
        assert found == {
            name: steps for name, steps in LEVELS.items() if name != "width" or not base.startswith("rgbd")
        }
    assert len({rung.name for rung in rungs}) == len(rungs)
    for rung in rungs:
        if rung.ladder == "missing stretches":
            frame, truth = rung.frame(1), rung.truth(1)
            assert frame.mask.shape == truth.mask.shape == SIZE
            assert (frame.depth is not None) == rung.base.startswith("rgbd")


def test_each_rung_is_worse_than_the_one_before_and_the_curves_are_the_same():
    rungs = noise_ladder(0.01, 1, (360, 640), bases=CALM)
    for name in ("salt and pepper", "edge jitter", "missing stretches"):
        ladder = [rung for rung in rungs if rung.ladder == name]
        clean = ladder[0].sequence.truth(1)
        wrong = [np.count_nonzero(rung.frame(1).mask ^ clean.mask) for rung in ladder]
        assert wrong[0] == 0
        assert (np.diff(wrong) > 0).all()
        assert all(rung.truth(1).curves == clean.curves for rung in ladder)


def test_widths_and_sizes_go_in_proportion():
    rungs = noise_ladder(0.01, 1, SIZE, bases=CALM)
    widths = [rung for rung in rungs if rung.ladder == "width"]
    for rung in widths:
        truth = rung.truth(0)
        if rung.level >= 8:
            measured = truth.mask.sum() / (truth.curves[0].length + rung.level / 4)
            assert measured == pytest.approx(rung.level / 4, rel=0.12)
        assert truth.curves == widths[0].truth(0).curves
    sizes = [rung for rung in rungs if rung.ladder == "size"]
    assert [rung.sequence.size for rung in sizes] == [(240, 320), (480, 640), (720, 1280), (1080, 1920), (2160, 3840)]
    assert [rung.sequence.width_px for rung in sizes] == [3.0, 6.0, 12.0, 18.0, 36.0]


def test_rungs_can_be_pickled_and_are_the_same_again():
    for rung in noise_ladder(0.01, 0, SIZE, bases=["rgb"])[::3]:
        again = pickle.loads(pickle.dumps(rung))
        assert (again.ladder, again.level, again.unit) == (rung.ladder, rung.level, rung.unit)
        if rung.ladder != "size":
            np.testing.assert_array_equal(again.frame(2).mask, rung.frame(2).mask)


def test_unknown_bases_and_scales_are_refused():
    with pytest.raises(InputError, match=r"bases must be some of 'rgb', .* got 'knots'"):
        noise_ladder(bases=["knots"])
    with pytest.raises(InputError, match="scale must be positive"):
        noise_ladder(-1.0)
