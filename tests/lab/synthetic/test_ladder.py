import pickle

import numpy as np
import pytest

from dloftbs.errors import InputError
from dloftbs_lab.synthetic import LADDER_BASES, KindSequence, LadderBase, noise_ladder, rgbd_artificial

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
OF_DEPTH = {
    "depth noise": [0, 0.5, 1, 2, 4],
    "depth holes": [0, 5, 10, 20, 40],
    "depth flying pixels": [0, 25, 50, 100],
    "depth grain": [0, 1, 2, 4, 8],
}


def levels(rungs):
    found = {}
    for rung in rungs:
        found.setdefault(rung.ladder, []).append(rung.level)
    return found


def test_ladders_have_their_rungs():
    rungs = noise_ladder(0.01, 0, SIZE, bases=CALM)
    assert levels(rungs) == LEVELS
    assert all(len(rung) == 2 for rung in rungs)
    assert rungs[2].name == "calm, salt and pepper 0.3 %"
    assert rungs[7].name == "calm, edge jitter 0.5 px"
    assert {rung.base for rung in rungs} == {"calm"}
    assert all(len(rung) == 10 for rung in noise_ladder(bases=CALM))


def test_every_suite_has_its_ladder():
    rungs = noise_ladder(0.01, 0, SIZE)
    for base in LADDER_BASES:
        found = levels([rung for rung in rungs if rung.base == base])
        known = {name: steps for name, steps in LEVELS.items() if name != "width" or not base.startswith("rgbd")}
        assert found == known | (OF_DEPTH if base == "rgbd artificial" else {})
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


def test_depth_gets_worse_on_its_ladders_and_nothing_else_changes():
    rungs = [rung for rung in noise_ladder(0.01, 1, (360, 640), bases=["rgbd artificial"]) if "depth" in rung.ladder]
    exact = rgbd_artificial(0.01, 1, (360, 640))[0].frame(1)
    for ladder in OF_DEPTH:
        of_ladder = [rung for rung in rungs if rung.ladder == ladder]
        frames = [rung.frame(1) for rung in of_ladder]
        for rung, frame in zip(of_ladder, frames, strict=True):
            np.testing.assert_array_equal(frame.mask, exact.mask)
            assert rung.truth(1).curves_3d == of_ladder[0].truth(1).curves_3d
        holes = [(frame.depth[exact.mask] == 0).mean() for frame in frames]
        expected = (
            [level / 100 for level in OF_DEPTH["depth holes"]] if ladder == "depth holes" else [0.05] * len(holes)
        )
        assert holes == pytest.approx(expected, abs=0.005)
        assert len({frame.depth.tobytes() for frame in frames}) == len(frames)
        if ladder == "depth noise":
            off = [np.median(np.abs(frame.depth - exact.depth)[frame.depth > 0]) for frame in frames]
            assert off[1:] == pytest.approx([off[2] * level for level in (0.5, 1, 2, 4)], rel=0.05)


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
    rungs = noise_ladder(0.01, 0, SIZE, bases=["rgb"])[::3]
    assert len(rungs) > 5
    for rung in rungs:
        again = pickle.loads(pickle.dumps(rung))
        assert (again.ladder, again.level, again.unit) == (rung.ladder, rung.level, rung.unit)
        if rung.ladder != "size":
            np.testing.assert_array_equal(again.frame(1).mask, rung.frame(1).mask)


def test_unknown_bases_and_scales_are_refused():
    with pytest.raises(InputError, match=r"bases must be some of 'rgb', .* got 'knots'"):
        noise_ladder(bases=["knots"])
    with pytest.raises(InputError, match="scale must be positive"):
        noise_ladder(-1.0)
