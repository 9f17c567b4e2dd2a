"""Simulated cables: they keep their length, move smoothly and are drawn where they are projected."""

import math
import pickle

import numpy as np
import pytest
from scipy.spatial import cKDTree

from dloftbs.errors import DloftbsError, InputError
from dloftbs_lab.synthetic import SIMULATED_KINDS, SimulatedSequence, simulated, simulation
from dloftbs_lab.synthetic.simulation import EXPERIMENTS, Experiment, simulate

SIZE = (240, 320)
FRAMES = 8

needs_mujoco = pytest.mark.skipif(not simulation.available(), reason=simulation.REMEDY)


def nodes_of(kind, seed=0, frames=FRAMES):
    return simulate(EXPERIMENTS[kind](np.random.default_rng(seed)), np.random.default_rng(seed), frames)


@needs_mujoco
@pytest.mark.parametrize("kind", SIMULATED_KINDS)
def test_cables_keep_their_length_and_move_smoothly(kind):
    nodes = nodes_of(kind)
    assert nodes.shape == (FRAMES, 41, 3)
    np.testing.assert_allclose(np.linalg.norm(np.diff(nodes, axis=1), axis=2), 0.015, rtol=1e-4)
    assert 1e-3 < np.linalg.norm(np.diff(nodes, axis=0), axis=2).max() < 0.35


@needs_mujoco
@pytest.mark.parametrize("kind", SIMULATED_KINDS)
def test_masks_are_where_the_projected_line_is(kind):
    sequence = SimulatedSequence(kind, 1, FRAMES, SIZE, seed=3)
    assert (sequence.fps, sequence.tolerance_px, sequence.cables) == (30.0, 5.0, 1)
    assert 2.0 <= sequence.width_px <= 10.0
    for index in (0, FRAMES - 1):
        frame, truth = sequence.frame(index), sequence.truth(index)
        np.testing.assert_array_equal(frame.mask, truth.mask)
        assert truth.ids == (0,)
        points = truth.curves[0].sample(1500)
        assert (points > 0.0).all()
        assert (points < np.array(SIZE[::-1]) - 1.0).all()
        rows, columns = np.nonzero(truth.mask)
        assert cKDTree(points).query(np.column_stack((columns, rows)))[0].max() < 3.0 * sequence.width_px
        assert sum(high - low for low, high in truth.shown_spans[0]) > 0.9


@needs_mujoco
def test_ends_that_are_led_go_where_they_are_led():
    way = np.array([-0.3, 0.1, 0.05])
    still = lambda phase: (np.zeros(3), np.zeros(3))  # noqa: E731
    led = Experiment(1e6, still, lambda phase: (phase * way, np.array([0.0, 0.0, 1.2 * phase])))
    nodes = simulate(led, np.random.default_rng(0), 31)
    np.testing.assert_allclose(nodes[:, 0], np.broadcast_to(nodes[0, 0], (31, 3)), atol=5e-3)
    np.testing.assert_allclose(nodes[-1, -2] - nodes[0, -2], 30.0 / 31.0 * way, atol=1e-2)
    last = nodes[-1, -1] - nodes[-1, -2]
    assert math.atan2(last[1], last[0]) == pytest.approx(1.2 * 30.0 / 31.0, abs=0.2)


@needs_mujoco
def test_what_is_let_go_snaps_back():
    nodes = nodes_of("snaps back", frames=40)
    between = np.linalg.norm(nodes[:, 0] - nodes[:, -1], axis=1)
    assert between[0] < 0.25
    assert between.max() > 0.3


@needs_mujoco
def test_frames_are_the_same_bit_for_bit_in_any_order_and_after_pickling():
    one = SimulatedSequence("twists", 0, FRAMES, SIZE)
    again = pickle.loads(pickle.dumps(one))
    again.truth(6)
    np.testing.assert_array_equal(one.frame(3).mask, again.frame(3).mask)
    assert one.truth(3).curves == again.truth(3).curves
    assert (SimulatedSequence("twists", 1, FRAMES, SIZE).frame(3).mask != one.frame(3).mask).any()


@needs_mujoco
def test_what_becomes_unstable_is_an_error(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)  # MuJoCo writes a log beside itself
    still = lambda phase: (np.zeros(3), np.zeros(3))  # noqa: E731
    with pytest.raises(DloftbsError, match="became unstable"):
        simulate(Experiment(1e12, still, None, gravity=True), np.random.default_rng(0), 10)


def test_without_mujoco_it_is_said_what_to_install(monkeypatch):
    monkeypatch.setattr(simulation, "available", lambda: False)
    with pytest.raises(InputError, match=r"pip install 'dloftbs\[evaluation\]'"):
        SimulatedSequence("hangs").frame(0)


def test_the_suite_has_all_kinds_and_scales_by_sequences():
    assert [one.family for one in simulated(0.01)] == [f"simulated {kind}" for kind in SIMULATED_KINDS]
    assert sum(len(one) for one in simulated()) == 4800


def test_what_cannot_be_is_refused():
    with pytest.raises(InputError, match=r"kind must be one of 'hangs', .* got 'flies'"):
        SimulatedSequence("flies")
    with pytest.raises(InputError, match="number must not be negative"):
        SimulatedSequence("hangs", -1)
