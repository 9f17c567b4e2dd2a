"""The fit of the weights of linking: labels, readings, the model."""

from __future__ import annotations

from itertools import islice
from pathlib import Path

import numpy as np
import pytest
from benchmarks.fit_linking.__main__ import COLUMNS, write_existence, write_lines, write_weights
from benchmarks.fit_linking.confidence import Claim, calibration_error, fit_crossings, fit_gaps, list_claims
from benchmarks.fit_linking.existence import Found, fit_existence, list_objects, piece_scenes
from benchmarks.fit_linking.labels import OPEN, UNKNOWN, true_partners
from benchmarks.fit_linking.model import ALWAYS_HELD, Fit, count_wrong, fit
from benchmarks.fit_linking.readings import Choice, list_choices
from benchmarks.fit_linking.scenes import Scene, list_scenes
from linking_examples import cross, draw, graph_of

from dloftbs import Frame
from dloftbs.data.graph import FREE, POSITION, TANGENT
from dloftbs.linking import calibration, existence_weights
from dloftbs.linking.kernels import joint_features, weights
from dloftbs_lab.synthetic import FreeEnd, draw_cable_mask

EVERY = np.concatenate((weights.JOINT, weights.OPEN))


def evenly(points: list[tuple[float, float]]) -> np.ndarray:
    (ax, ay), (bx, by) = points
    steps = int(np.hypot(bx - ax, by - ay))
    return np.column_stack((np.linspace(ax, bx, steps), np.linspace(ay, by, steps)))


def crossing() -> Scene:
    cables = cross(60)
    return Scene("drawn", Frame(mask=draw(*cables)), tuple(evenly(cable) for cable in cables))


def test_the_truth_of_a_crossing_goes_straight_on() -> None:
    scene = crossing()
    crop, graph = graph_of(scene.frame.mask)
    partner = true_partners(scene, crop, graph)
    at_node = np.flatnonzero(graph.nodes >= 0)
    assert (partner[graph.nodes == FREE] == OPEN).all()
    states = graph.end_states
    for end in at_node.tolist():
        other = int(partner[end])
        assert int(partner[other]) == end
        assert states[end, 2:4] @ states[other, 2:4] < -0.9


def test_weights_that_are_held_stay_and_a_column_that_is_not_used_weighs_nothing() -> None:
    rng = np.random.default_rng(0)
    choices = []
    for _ in range(60):
        rows = rng.uniform(0.0, 1.0, (3, len(EVERY)))
        rows[:, 4] = 0.0
        choices.append(Choice("drawn", rows, int(np.argmin(rows @ EVERY))))
    held = [0, *ALWAYS_HELD]
    found = fit(choices, held)
    assert found.weights[held].tolist() == EVERY[held].tolist()
    assert not found.deviations[held].any()
    assert np.isfinite(found.weights).all()
    assert found.weights[4] == found.deviations[4] == 0.0
    assert found.deviations[1] > 0.0


def test_without_recordings_there_is_no_recorded_scene(tmp_path: Path) -> None:
    with pytest.raises(SystemExit, match="motion"):
        list(list_scenes("recorded", 1, 1.0, tmp_path))


def test_a_whole_scene_is_yielded_once() -> None:
    every = islice(list_scenes("hidden", 1, 0.02, Path()), 12)
    whole = list(islice(list_scenes("hidden", 1, 0.02, Path(), whole=True), 4))
    assert all(scene.frame.image is not None and scene.frame.depth is not None for scene in whole)
    last_of_three = list(every)[2::3]
    assert all(map(np.array_equal, *([scene.frame.depth for scene in scenes] for scenes in (last_of_three, whole))))
    assert len(last_of_three) == len(whole) == 4


def test_labels_tell_the_same_as_curves() -> None:
    scene = crossing()
    crop, graph = graph_of(scene.frame.mask)
    one, other = (draw(cable) for cable in cross(60))
    labels = np.where(one, 1, np.where(other, 2, 0)).astype(np.uint8)
    by_labels = true_partners(Scene("drawn", scene.frame, labels=labels), crop, graph)
    at_node = graph.nodes >= 0
    np.testing.assert_array_equal(by_labels[at_node], true_partners(scene, crop, graph)[at_node])
    assert (by_labels[~at_node] == UNKNOWN).all()


def test_a_cable_goes_on_in_the_straightest_of_its_strands() -> None:
    """A frayed end near the camera: wires that are no spurs, since they are longer than the cable is wide."""
    body, tip = np.column_stack((np.arange(60.0, 220.0), np.full(160, 120.0))), (220.0, 120.0)
    mask = draw_cable_mask(body, np.linspace(8.0, 40.0, len(body)), (240, 320), (FreeEnd("round"), FreeEnd("flat")))
    for angle in (-0.5, 0.05, 0.6):
        wire = np.array(tip) + np.outer(np.arange(-10.0, 50.0, 0.5), (np.cos(angle), np.sin(angle)))
        mask |= draw_cable_mask(wire, np.full(len(wire), 6.0), mask.shape)
    scene = Scene("drawn", Frame(mask=mask), (body,))
    crop, graph = graph_of(scene.frame.mask)
    partner, nodes = true_partners(scene, crop, graph), graph.nodes
    places = crop.to_image(graph.end_states[:, POSITION])
    (cable,) = [end for end in np.flatnonzero(nodes >= 0).tolist() if places[end ^ 1, 0] < 100.0]
    strand = int(partner[cable])
    assert int(partner[strand]) == cable
    assert graph.end_states[cable, TANGENT] @ graph.end_states[strand, TANGENT] < -0.95
    others = [end for end in range(len(nodes)) if end not in (cable, strand)]
    assert (partner[others] < 0).all()
    assert (partner[others] == OPEN).sum() >= 4


def test_a_crossing_has_ten_readings_and_the_true_one_costs_the_least() -> None:
    (choice,) = [choice for choice in list_choices([crossing()]) if len(choice.rows) > 2]
    assert len(choice.rows) <= 10
    assert count_wrong([choice], EVERY) == 0
    junction = len(weights.JOINT) + joint_features.OPEN_JUNCTION
    assert choice.rows[:, junction].max() == 4.0
    assert choice.rows[choice.true, junction] == 0.0


def test_the_fit_finds_the_weights_that_made_the_data() -> None:
    rng = np.random.default_rng(0)
    true = rng.normal(size=len(EVERY))
    held = [joint_features.OTHER_COLOUR, joint_features.GAP_SEEN]
    true[held] = weights.JOINT[held]
    choices = []
    for _ in range(3000):
        rows = 0.5 * rng.normal(size=(4, len(EVERY)))
        odds = np.exp(-(rows @ true))
        choices.append(Choice("drawn", rows, int(rng.choice(4, p=odds / odds.sum()))))
    found = fit(choices)
    assert (np.abs(found.weights - true) <= 4.0 * found.deviations + 1e-9).all()
    assert found.deviations.max() < 0.2
    assert np.flatnonzero(found.deviations == 0.0).tolist() == held


def test_the_confidence_follows_the_share_that_is_right() -> None:
    rng = np.random.default_rng(0)
    margins, costs = rng.uniform(0.0, 8.0, (2, 20_000))
    right = rng.random(len(margins)) < 1.0 / (1.0 + np.exp(-(0.5 + 0.4 * margins - 0.2 * costs)))
    claims = [
        Claim("drawn", "crossing", margin, cost, 0.5, one)
        for margin, cost, one in zip(margins.tolist(), costs.tolist(), right.tolist(), strict=True)
    ]
    assert fit_crossings(claims) == pytest.approx([0.5, 0.4, -0.2], abs=0.1)


def test_the_confidence_of_gaps_follows_what_they_join_and_sources_count_alike() -> None:
    rng = np.random.default_rng(0)
    margins, seen, taper = rng.uniform(0.0, 3.0, (3, 40_000))
    right = rng.random(len(margins)) < 1.0 / (1.0 + np.exp(-(-1.0 + 0.4 * margins + 1.0 * seen - 0.8 * taper)))
    rows = list(zip(margins.tolist(), seen.tolist(), taper.tolist(), right.tolist(), strict=True))
    many = [Claim("masks", "gap", m, 0.0, 0.5, one, True, s, t) for m, s, t, one in rows]
    found = fit_gaps(many)
    assert np.sign(found).tolist() == [-1.0, 1.0, 1.0, -1.0]
    wrong = [Claim("worms", "gap", 1.0, 0.0, 0.5, False, True, 1.0, 1.0)]
    once, often = fit_gaps(many + wrong), fit_gaps(many + 50 * wrong)
    assert once == pytest.approx(often, abs=1e-3)
    assert once[0] < found[0]


def test_the_calibration_error_is_that_of_the_bins() -> None:
    stated, right = np.array([0.9, 0.9, 0.9, 0.9, 0.55, 0.55]), np.array([True, True, True, False, True, False])
    assert calibration_error(stated, right) == pytest.approx((4 * 0.15 + 2 * 0.05) / 6)


def test_joints_and_cables_are_judged() -> None:
    claims = list(list_claims(list_scenes("broken", 1, 0.01, Path())))
    assert {claim.kind for claim in claims} == {"cable", "gap"}
    assert any(claim.right for claim in claims)


@pytest.mark.parametrize("source", ["photographs", "masks"])
def test_without_photographs_nothing_is_fitted(tmp_path: Path, source: str) -> None:
    with pytest.raises(SystemExit, match="lacks"):
        list(list_scenes(source, 1, 1.0, tmp_path))


def test_what_is_written_is_what_is_in_use() -> None:
    """The two files are as the script makes them, so that nobody edits them by hand."""
    assert len(COLUMNS) == len(EVERY)
    assert all(getattr(joint_features, name) >= 0 for name in COLUMNS)
    assert Path(weights.__file__).read_text() == write_weights(Fit(EVERY, EVERY))
    lines = {"crossing": np.array(calibration.CROSSING), "gap": np.array(calibration.GAP)}
    assert Path(calibration.__file__).read_text() == write_lines(lines)


class TestExistence:
    def test_a_crumb_of_a_labelled_cable_and_what_lies_off_it_are_no_cables(self) -> None:
        cable, other, crumb, off = (
            [(20, 60), (380, 60)],
            [(20, 200), (300, 200)],
            [(20, 120), (36, 120)],
            [(200, 120), (240, 120)],
        )
        whole = draw(cable) + 2 * draw(other) + 3 * draw([(20, 120), (380, 120)])
        scene = Scene(
            "drawn", Frame(mask=draw(cable, other, crumb, off)), labels=np.where(draw(off), 0, whole).astype(np.uint8)
        )
        found = sorted(list_objects([scene]), key=lambda one: one.share)
        assert [one.is_cable for one in found] == [False, False, True]
        assert found[2].share == pytest.approx(280 / 360, rel=0.05)

    def test_on_known_curves_all_pieces_are_cables(self) -> None:
        found = list(list_objects(piece_scenes(1, 6)))
        assert len(found) > 8
        assert all(one.is_cable for one in found)

    def test_frames_with_more_than_a_mask_and_single_objects_say_nothing(self) -> None:
        alone, mask = draw(cross(60)[0]), draw(*cross(60))
        frames = Frame(mask=alone), Frame(mask=mask, image=np.zeros((*mask.shape, 3), np.uint8))
        assert not list(list_objects(Scene("drawn", frame, tuple(map(evenly, cross(60)))) for frame in frames))

    def test_the_fit_finds_the_odds_that_it_was_given(self) -> None:
        rng = np.random.default_rng(0)
        shares = np.exp(rng.uniform(-6.0, 0.0, 20_000))
        is_cable = rng.random(20_000) < 1.0 / (1.0 + np.exp(-(6.0 + 2.0 * np.log(shares))))
        objects = [Found("drawn", *each) for each in zip(shares.tolist(), is_cable.tolist(), strict=True)]
        np.testing.assert_allclose(fit_existence(objects), (6.0, 2.0), rtol=0.05)

    def test_what_is_written_is_what_is_in_use(self) -> None:
        assert write_existence(np.array(existence_weights.SIZE)) == Path(existence_weights.__file__).read_text()
