"""Diagrams whose knots, links and moves are known."""

from __future__ import annotations

import dataclasses
import json
import pickle

import numpy as np
import pytest
from builders import curve_through, detection_of, line

import dloftbs
from dloftbs import BSplineCurve, Crossing, FrameResult, InputError, topology
from dloftbs.config import DepthConfig
from dloftbs.fitting import find_crossings
from dloftbs.topology import Diagram, EndMove, Move

TREFOIL = [(5, 2, 0, 3), (3, 0, 4, 1), (1, 4, 2, 5)]
FIGURE_EIGHT = [(4, 1, 5, 2), (6, 4, 7, 3), (8, 5, 1, 6), (2, 8, 3, 7)]
PRETZEL_8_19 = [(15, 5, 0, 4), (5, 1, 6, 0), (10, 2, 11, 1), (2, 14, 3, 13), (3, 9, 4, 8), (11, 7, 12, 6)]
PRETZEL_8_19 += [(7, 13, 8, 12), (14, 10, 15, 9)]
WHITEHEAD = [(6, 1, 7, 2), (10, 7, 5, 8), (4, 5, 1, 6), (2, 10, 3, 9), (8, 4, 9, 3)]
TABLE = {
    "3_1": (3, TREFOIL),
    "4_1": (5, FIGURE_EIGHT),
    "5_1": (5, [(9, 4, 0, 5), (5, 0, 6, 1), (1, 6, 2, 7), (7, 2, 8, 3), (3, 8, 4, 9)]),
    "5_2": (7, [(4, 0, 5, 9), (0, 6, 1, 5), (8, 2, 9, 1), (2, 8, 3, 7), (6, 4, 7, 3)]),
    "6_1": (9, [(6, 11, 7, 0), (0, 5, 1, 6), (10, 2, 11, 1), (2, 10, 3, 9), (8, 4, 9, 3), (4, 8, 5, 7)]),
    "6_2": (11, [(11, 7, 0, 6), (7, 1, 8, 0), (1, 9, 2, 8), (5, 3, 6, 2), (3, 10, 4, 11), (9, 4, 10, 5)]),
    "6_3": (13, [(8, 11, 9, 0), (0, 4, 1, 3), (6, 2, 7, 1), (2, 8, 3, 7), (4, 9, 5, 10), (10, 5, 11, 6)]),
}
"""Determinants and planar-diagram codes. Source: D. Rolfsen's table, codes of KnotTheory and spherogram."""


def on_circle(turns: float, n: int = 80) -> np.ndarray:
    return np.linspace(0.0, 2.0 * np.pi * turns, n, endpoint=False)


def trefoil(n: int = 80) -> np.ndarray:
    """Return a closed trefoil in space, (n, 3)."""
    t = on_circle(1, n) + 0.01
    return np.stack((np.sin(t) + 2 * np.sin(2 * t), np.cos(t) - 2 * np.cos(2 * t), -np.sin(3 * t)), axis=1)


def rings(hooked: bool) -> list[np.ndarray]:
    t = on_circle(1, 30) + 0.01
    one = np.stack((np.cos(t), np.sin(t), 0.0 * t), axis=1)
    other = np.stack((1.0 + np.cos(t), 0.1 + np.sin(t), np.sin(t) if hooked else 1.0 + 0.0 * t), axis=1)
    return [one, other]


def overhand(tops: tuple[int | None, ...] = (1, 0, 1), closed: bool = False) -> Diagram:
    """Return an overhand knot with orders by choice: of the alternating ones, it is knotted."""
    return Diagram(((0, 1, 2, 0, 1, 2),), (closed,), (1, -1, 1), tops)


def result_of(*curves: BSplineCurve, crossings: tuple[Crossing, ...] = ()) -> FrameResult:
    detections = tuple(detection_of(curve, radius=5.0) for curve in curves)
    return FrameResult(detections, (), None, (300, 300), crossings=crossings)


def rope(top: int | None = 0, confidence: float = 0.9) -> FrameResult:
    """Return a frame with a cable that makes one loop."""
    t = np.linspace(-1.6, 1.6, 80)
    curve = curve_through(np.stack((160 + 90 * (t**3 - t), 60 + 60 * t**2), axis=1))
    ends = (curve.nearest((160, 120))[0], 1.0 - curve.nearest((160, 120))[0])
    low, high = sorted(ends)
    return result_of(curve, crossings=(Crossing((160.0, 120.0), ((0, low), (0, high)), top, confidence),))


class TestKnots:
    @pytest.mark.parametrize("name", TABLE)
    def test_tabulated_knots_have_their_determinant_and_name(self, name: str) -> None:
        determinant, code = TABLE[name]
        diagram = Diagram.from_pd_code(code)
        assert (diagram.name, diagram.determinant, diagram.is_knotted) == (name, determinant, True)
        assert len(diagram.simplify().diagram.turns) == len(code)
        assert diagram.next_move is None

    def test_the_trefoil_has_its_polynomial_and_its_hand(self) -> None:
        left = Diagram.from_pd_code(TREFOIL)
        assert left.alexander_polynomial == (1, -1, 1)
        assert left.signs == (-1, -1, -1)
        right = Diagram.from_curves([trefoil() * (1, 1, -1)], closed=True)
        assert {left.writhe, right.writhe, Diagram.from_curves([trefoil()], closed=True).writhe} == {-3, 3}

    def test_a_larger_knot_is_knotted_and_has_no_name(self) -> None:
        diagram = Diagram.from_pd_code(PRETZEL_8_19)
        assert (diagram.name, diagram.is_knotted, diagram.determinant) == (None, True, 3)
        assert diagram.alexander_polynomial == (1, -1, 0, 1, 0, -1, 1)

    def test_no_crossings_are_no_knot(self) -> None:
        ring = Diagram.from_curves([trefoil()[:, [2, 0, 1]][:3]], closed=True)
        assert (ring.is_knotted, ring.name, ring.determinant, ring.pd_code) == (False, "0_1", 1, ())
        assert ring.is_tangled is False
        assert Diagram((), (), (), ()).is_knotted is False

    def test_a_diagram_that_has_answered_can_be_sent_to_another_process(self) -> None:
        diagram = overhand()
        assert diagram.is_knotted
        assert pickle.loads(pickle.dumps(diagram)) == diagram

    def test_an_order_exchanged_undoes_the_knot(self) -> None:
        assert overhand().is_knotted is True
        assert overhand((1, 0, 0)).is_knotted is False
        moves = overhand((1, 0, 0), closed=True).simplify().moves
        assert [move.kind for move in moves][-1] == "I"
        assert sorted(crossing for move in moves for crossing in move.crossings) == [0, 1, 2]


class TestUnknownOrders:
    def test_an_unknown_order_that_matters_is_no_answer(self) -> None:
        diagram = overhand((1, None, 1))
        assert diagram.is_knotted is diagram.name is diagram.determinant is diagram.gauss_code is diagram.writhe is None
        assert diagram.pd_code is None

    def test_an_unknown_order_of_a_plain_loop_does_not_matter(self) -> None:
        loop = Diagram(((0, 0),), (False,), (1,), (None,))
        assert (loop.is_knotted, loop.name, loop.probability) == (False, "0_1", 0.5)
        assert loop.simplify().moves == (Move("I", (0,)),)

    def test_too_many_unknown_orders_are_not_tried(self) -> None:
        code = Diagram.from_pd_code(PRETZEL_8_19)
        chain = dataclasses.replace(code, tops=(None,) * 8)
        assert len(list(chain._readings())) == 2**8
        assert chain.is_knotted is None

    def test_a_move_relies_on_no_guess(self) -> None:
        clasp = Diagram(((0, 1), (0, 1)), (False, False), (1, -1), (0, None))
        assert clasp.simplify().moves == ()
        over = Diagram(((0, 1), (0, 1)), (False, False), (1, -1), (0, 0))
        assert over.simplify().moves == (Move("II", (0, 1)),)


class TestSeveral:
    @pytest.mark.parametrize("hooked", [True, False])
    def test_two_rings(self, hooked: bool) -> None:
        diagram = Diagram.from_curves(rings(hooked), closed=True)
        assert diagram.is_tangled is hooked
        assert diagram.is_knotted is False
        assert abs(diagram.linking_numbers[0, 1] or 0) == hooked
        assert diagram.determinant == 2 * hooked
        assert diagram.name is None
        assert len(diagram.simplify().diagram.turns) == 2 * hooked

    def test_two_hooked_pairs_apart_from_each_other_are_tangled(self) -> None:
        pairs = Diagram.from_gauss_code([[1, -2], [-1, 2], [3, -4], [-3, 4]], [1, 1, 1, 1])
        assert pairs.is_tangled is True
        assert pairs.alexander_polynomial == ()

    def test_links_apart_are_judged_each_by_itself(self) -> None:
        links = [tuple(edge + shift for edge in one) for shift in (0, 10) for one in WHITEHEAD]
        diagram = Diagram.from_pd_code(links)
        assert set(diagram.linking_numbers.values()) == {0}
        assert diagram.is_tangled is True

    def test_cables_that_cross_once_are_not_tangled(self) -> None:
        diagram = Diagram.from_curves([[(0, 0, 0), (2, 0, 0)], [(1, -1, 1), (1, 1, 1)]])
        assert diagram.is_tangled is False
        assert diagram.is_knotted is False
        assert diagram.linking_numbers == {(0, 1): None}  # it depends on how the ends are joined
        assert diagram.gauss_code is None
        assert diagram.next_move in [EndMove(0, 0, 0, False), EndMove(1, 0, 0, True)]

    def test_a_single_crossing_of_unknown_order_tangles_nothing(self) -> None:
        once = Diagram(((0,), (0,)), (False, False), (1,), (None,))
        assert once.is_tangled is False
        twice = Diagram(((0, 1), (0, 1)), (False, False), (1, -1), (None, None))
        assert twice.is_tangled is None
        assert twice.linking_numbers == {(0, 1): None}

    def test_cables_apart_are_not_listed(self) -> None:
        curves = line((40, 120), (280, 120)), line((130, 30), (190, 210)), line((10, 10), (20, 10))
        result = result_of(*curves, crossings=(Crossing((160.0, 120.0), ((0, 0.5), (1, 0.5)), 1, 0.9),))
        assert topology.describe(result)["linking_numbers"] == [[0, 1, None]]
        assert Diagram.from_result(result).linking_numbers == {(0, 1): None, (0, 2): 0, (1, 2): 0}

    def test_cables_twisted_around_each_other_are_tangled(self) -> None:
        x = np.linspace(0.0, 2.0 * np.pi, 40)
        one = np.stack((x, np.cos(x), np.sin(x)), axis=1)
        diagram = Diagram.from_curves([one, one * (1, -1, -1)])
        assert diagram.is_tangled is True
        assert abs(diagram.linking_numbers[0, 1] or 0) == 1
        assert diagram.is_knotted is False

    def test_a_part_is_the_same_strand_alone(self) -> None:
        both = Diagram.from_curves([trefoil(), np.add(trefoil(), (0.3, 0.2, 9.0))], closed=True)
        assert both.is_knotted is both.is_tangled is True
        assert both.linking_numbers == {(0, 1): 0}
        assert both.part([1]).name == both.part([0]).name == "3_1"
        assert both.part([0]).objects == (0,)
        assert set(both.part([1]).labels) < set(both.labels)
        with pytest.raises(InputError, match=r"a strand must be an integer in 0..1, got 2"):
            both.part([2])


class TestEnds:
    def test_an_end_inside_is_led_out_over_and_under(self) -> None:
        """Over everything it makes a trefoil of two crossings, under everything it does not."""
        inside = Diagram(((0, 1, 0, 1),), (False,), (1, -1), (1, 0))
        assert {inside.close(over).name for over in (True, False)} == {"0_1", "3_1"}
        assert inside.is_knotted is inside.name is inside.pd_code is inside.gauss_code is None
        assert abs(inside.writhe or 0) == 2
        assert inside.signs is None

    def test_where_both_ways_agree_the_codes_are_those_over_everything(self) -> None:
        inside = Diagram(((0, 1, 0, 1),), (False,), (1, -1), (1, 1))
        assert inside.is_knotted is False
        closed = inside.close(True)
        assert inside.pd_code == closed.pd_code
        (code,) = inside.gauss_code or ()
        assert len(code) == 2 * len(closed.turns) == 6
        assert Diagram.from_gauss_code([code], inside.signs or ()).pd_code == inside.pd_code
        assert code[-1] > 0

    @pytest.mark.parametrize("over", [True, False])
    def test_closing_crosses_over_or_under_everything(self, over: bool) -> None:
        closed = Diagram(((0, 1, 0, 1),), (False,), (1, -1), (1, 0)).close(over)
        assert closed.closed == (True,)
        assert closed.labels == (0, 1, 2)
        (code,) = closed.gauss_code or ()
        assert (code[-1] > 0) is over
        with pytest.raises(InputError, match="over must be True or False, got 1"):
            closed.close(1)  # type: ignore[arg-type]

    def test_ends_on_the_outside_are_joined_without_crossings(self) -> None:
        assert overhand().close(True) == overhand().close(False) == overhand(closed=True)

    def test_the_next_move_draws_an_end_back(self) -> None:
        move = overhand().next_move
        assert move is not None
        assert move.crossing in (0, 2)
        assert move == EndMove(0, 1, 2, True)  # what lies on top is lifted rather than what lies below drawn out
        assert Diagram(((),), (False,), (), ()).next_move is None

    def test_simplification_leaves_the_ends_in_place(self) -> None:
        hook = Diagram.from_curves([[(0, 0, 0), (2, 0, 0), (2, 1, 1), (1, 1, 1), (1, -1, 1)]])
        assert hook.simplify().diagram.turns == ()  # a loop at the end, which the first move undoes
        assert hook.simplify().diagram.is_open


class TestOfResults:
    def test_a_rope_is_read_with_its_crossings(self) -> None:
        diagram = Diagram.from_result(rope())
        assert diagram.passes == ((0, 0),)
        assert (diagram.tops, diagram.probability, diagram.is_knotted) == ((0,), 0.9, False)

    def test_an_order_that_is_hardly_known_counts_as_unknown(self) -> None:
        assert Diagram.from_result(rope(0, 0.79)).tops == (None,)
        assert Diagram.from_result(rope(0, 0.79), min_confidence=0.79).tops == (0,)
        by_hand = Diagram.from_result(rope(0, 0.0))
        assert (by_hand.tops, by_hand.confidences) == ((0,), (1.0,))
        assert Diagram.from_result(rope(None, 0.0)).tops == (None,)

    @pytest.mark.parametrize(
        ("widths", "top", "least"), [(0.01, 0, 0.95), (0.06, 0, 0.9), (0.2, None, 0.55), (50.0, None, 0.5)]
    )
    def test_an_order_is_a_guess_where_the_curves_may_lie_beside_their_axes(self, monkeypatch, widths, top, least):
        """Strands that nearly touch draw curves off their axes, which read another strand's look: most are wrong."""
        result = rope(0, 0.95)
        width = result.detections[0].width_px
        monkeypatch.setattr(dloftbs.Detection, "curve_std", lambda self, u: np.full(np.shape(u), widths * width))
        diagram = Diagram.from_result(result)
        assert diagram.tops == (top,)
        assert least <= diagram.confidences[0] <= 0.95
        assert (diagram.probability == 0.5) is (top is None)

    def test_a_strand_that_is_rather_wrong_gives_no_answer(self) -> None:
        diagram = dataclasses.replace(overhand(), strand_confidences=(0.49,))
        assert diagram.is_knotted is diagram.name is diagram.determinant is diagram.pd_code is None
        assert diagram.writhe is diagram.next_move is None
        assert diagram.probability == 0.49
        assert dataclasses.replace(overhand(), strand_confidences=(0.5,)).is_knotted is True

    def test_a_closed_strand_that_is_rather_wrong_has_no_code(self) -> None:
        knot = Diagram.from_curves([trefoil()], closed=True)
        assert knot.gauss_code is not None
        wrong = dataclasses.replace(knot, strand_confidences=(0.49,))
        assert wrong.gauss_code is wrong.pd_code is wrong.signs is wrong.writhe is None

    def test_what_a_strand_that_is_rather_wrong_has_with_others_is_unknown(self) -> None:
        apart = Diagram(((), (), ()), (True, True, True), (), ())
        assert set(apart.linking_numbers.values()) == {0}
        assert dataclasses.replace(apart, strand_confidences=(0.49, 1.0, 1.0)).linking_numbers == {
            (0, 1): None,
            (0, 2): None,
            (1, 2): 0,
        }

    def test_the_sign_is_that_of_space(self) -> None:
        """In a camera's frame, with y down and z away, the curve on top has the smaller z."""
        result = rope(0)
        curve = result[0].curve
        (_, low), (_, high) = result.crossings[0].passes
        u = np.linspace(0.0, 1.0, 200)
        depth = 2.0 + np.where(u < 0.5 * (low + high), -1.0, 1.0)
        in_space = np.column_stack((curve(u), depth))
        assert Diagram.from_curves([in_space]).signs == Diagram.from_result(result).signs

    def test_curves_along_one_line_do_not_meet_beside_each_other(self) -> None:
        straight, onward = line((0.1, 0.2, 0.3), (0.4, 0.9, 0.5)), line((0.7, 1.6, 0.5), (1.0, 2.3, 0.5))
        step = [(0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (1.0, 0.0, 1.0), (2.0, 0.0, 1.0)]
        assert Diagram.from_curves([straight, onward, step]).turns == ()

    @pytest.mark.parametrize("closed", [False, True])
    def test_points_that_stand_twice_change_nothing(self, closed: bool) -> None:
        angles = np.linspace(0.1, 2.0 * np.pi + 0.1, 120, endpoint=False)
        trefoil = np.stack(
            (
                np.sin(angles) + 2.0 * np.sin(2.0 * angles),
                np.cos(angles) - 2.0 * np.cos(2.0 * angles),
                -np.sin(3.0 * angles),
            ),
            axis=1,
        )
        twice = np.repeat(trefoil, 2, axis=0)
        if closed:
            twice = np.concatenate((twice, trefoil[:1]))
        assert Diagram.from_curves([twice], closed) == Diagram.from_curves([trefoil], closed)

    def test_objects_are_chosen(self) -> None:
        curves = line((40, 120), (280, 120)), line((130, 30), (190, 210))
        crossing = Crossing((160.0, 120.0), ((0, curves[0].nearest((160, 120))[0]), (1, 0.5)), 1, 0.9)
        result = result_of(*curves, crossings=(crossing,))
        both = Diagram.from_result(result)
        assert both.passes == ((0,), (0,))
        assert both.tops == (1,)
        assert both.signs == Diagram.from_result(result, objects=[1, 0]).signs
        assert Diagram.from_result(result, objects=[1, 0]).tops == (0,)
        assert Diagram.from_result(result, objects=[1]).passes == ((),)

    def test_tracks_are_read_in_their_direction(self) -> None:
        result = rope()
        track = dloftbs.Track(
            1, dloftbs.TrackState.CONFIRMED, result[0].curve.reversed(), None, 1, 0, result[0].reversed()
        )
        backwards = dataclasses.replace(result, tracks=(track,))
        diagram = Diagram.from_result(backwards, objects=backwards.tracks)
        assert (diagram.tops, diagram.signs) == ((1,), Diagram.from_result(result).signs)
        hidden = dataclasses.replace(track, detection=None, state=dloftbs.TrackState.HIDDEN)
        with pytest.raises(InputError, match="track 1 has no detection in this frame, and no crossings: it is hidden"):
            Diagram.from_result(backwards, objects=[hidden])

    def test_a_crossing_that_lies_elsewhere_is_refused(self) -> None:
        result = dataclasses.replace(rope(), crossings=(Crossing((10.0, 10.0), ((0, 0.1), (0, 0.9))),))
        with pytest.raises(InputError, match=r"crossing 0 lies \d+ px from detection 0 at u=0.1, more than its width"):
            Diagram.from_result(result)
        assert "crossing 0 lies" in topology.describe(result)["reason"]

    def test_a_crossing_of_a_detection_that_is_not_there_is_refused(self) -> None:
        result = dataclasses.replace(rope(), crossings=(Crossing((160.0, 120.0), ((0, 0.1), (3, 0.9))),))
        with pytest.raises(InputError, match="crossing 0 is one of detection 3, but there are 1"):
            Diagram.from_result(result)

    @pytest.mark.parametrize("seed", range(6))
    @pytest.mark.parametrize("backwards", [False, True])
    def test_cables_that_cross_along_a_stretch_turn_as_their_sides_do(self, seed: int, backwards: bool) -> None:
        rng = np.random.default_rng(seed)
        s = np.linspace(-150, 150, 60)
        away = 0.7 * np.sign(s) * np.maximum(np.abs(s) - rng.uniform(10, 70), 0.0)
        one, other = (
            curve_through(np.stack((160 + s, 120 + side * away + rng.normal(0, 0.4, 60)), axis=1)) for side in (1, -1)
        )
        detections = tuple(detection_of(c, radius=5.0) for c in (one, other.reversed() if backwards else other))
        crossings = find_crossings(detections, dloftbs.Frame(mask=np.zeros((240, 320), np.uint8)), DepthConfig())
        result = FrameResult(detections, (), None, (240, 320), crossings=crossings)
        assert Diagram.from_result(result).turns == (-1 if backwards else 1,)

    def test_a_missing_crossing_is_noticed(self) -> None:
        """A strand crosses a closed one an even number of times."""
        with pytest.raises(InputError, match="no curves in the plane have these crossings: one is missing"):
            Diagram(((0,), (0,)), (True, True), (1,), (0,))

    def test_everything_is_ready_for_json(self) -> None:
        told = topology.describe(rope())
        assert json.loads(json.dumps(told)) == told
        assert told["reason"] is None
        assert (told["is_knotted"], told["names"], told["remaining_crossings"]) == (False, ["0_1"], [])
        assert told["moves"] == [{"kind": "I", "crossings": [0]}]
        empty = topology.describe(FrameResult((), (), "nothing", (4, 4)))
        assert (empty["is_knotted"], empty["crossings"]) == (False, [])
        with pytest.raises(InputError, match="result must be a FrameResult"):
            topology.describe([])  # type: ignore[arg-type]


class TestWrong:
    @pytest.mark.parametrize(
        ("fields", "message"),
        [
            ({"passes": ((0, 1),)}, r"passes must have each of the 1 crossings of turns twice"),
            ({"closed": ()}, "closed must have 1 items, got 0"),
            ({"closed": (1,)}, "closed must be True or False, got 1"),
            ({"turns": (2,)}, r"turns must be an integer in -1..1, got 2"),
            ({"turns": (0,)}, "turns must be 1 or -1, got 0"),
            ({"tops": (2,)}, r"tops must be an integer in 0..1, got 2"),
            ({"tops": ()}, "tops must have 1 items, got 0"),
            ({"confidences": (1.5,)}, r"confidences must be a finite number in 0..1, got 1.5"),
            ({"labels": (1, 2)}, "labels must have 1 items, got 2"),
            (
                {"passes": ((0,), (0,)), "closed": (False, False), "objects": (1, 1)},
                r"objects must differ, got \(1, 1\)",
            ),
            ({"objects": (1, 2)}, "objects must have 1 items, got 2"),
            ({"passes": 5}, "passes must be a sequence, got 5"),
        ],
    )
    def test_wrong_fields_are_refused(self, fields: dict[str, object], message: str) -> None:
        given = {"passes": ((0, 0),), "closed": (True,), "turns": (1,), "tops": (0,), **fields}
        with pytest.raises(InputError, match=message):
            Diagram(**given)  # type: ignore[arg-type]

    @pytest.mark.parametrize(
        ("code", "message"),
        [
            ([(1, 2, 3)], "a crossing of a planar-diagram code has 4 edges"),
            ([(1, 1, 2, 3)], "each edge of a planar-diagram code must be there twice, 2 is not"),
            ([(1, 1, 2, -2)], r"an edge must be an integer in 0..9007199254740992, got -2"),
            ([(1, 2, 1, 2)], "no curves in the plane have these crossings"),
            ([(1, 2, 3, 4), (1, 4, 3, 2)], "the strand below crossing 1 of the code runs against its direction"),
        ],
    )
    def test_wrong_planar_diagram_codes_are_refused(self, code: list[tuple[int, ...]], message: str) -> None:
        with pytest.raises(InputError, match=message):
            Diagram.from_pd_code(code)

    @pytest.mark.parametrize(
        ("code", "signs", "message"),
        [
            ([[1, 0]], [1], "crossings of a Gauss code are numbered from 1 on, got 0"),
            ([[1, 2]], [1], r"a number of code must be an integer in -1..1, got 2"),
            ([[1, 1]], [1], "crossing 1 of a Gauss code must be there once above and once below"),
            ([[1, -1]], [0], "signs must be 1 or -1, got 0"),
        ],
    )
    def test_wrong_gauss_codes_are_refused(self, code: list[list[int]], signs: list[int], message: str) -> None:
        with pytest.raises(InputError, match=message):
            Diagram.from_gauss_code(code, signs)

    @pytest.mark.parametrize(
        ("curves", "message"),
        [
            (
                [[(0, 0, 0), (2, 0, 0)], [(1, -1, 0), (1, 1, 0)]],
                "curves 0 and 1 meet, or a corner of one lies over the",
            ),
            ([[(0, 0, 0), (2, 0, 0)], [(1, 0, 1), (1, 1, 1)]], "turn them a little"),
            ([[(0, 0, 0), (2, 0, 0)], [(1, 0, 1), (3, 0, 1)]], "a side of curve 0 lies over one of curve 1: turn them"),
            ([[(0, 0, 0), (0.3, 0.1, 0)], [(0.6, 0.2, 1), (0.15, 0.05, 1)]], "a side of curve 0 lies over"),
            ([[(0, 0, 0), (2, 0, 0), (1, 0, 1)]], "a side of curve 0 lies over one of curve 0"),
            ([[(0, 0, 0)]], "a curve needs at least 2 different points, got 1"),
            ([[(0, 0, 0)] * 3], "a curve needs at least 2 different points, got 1"),
            ([[(0, 0)] * 3], r"a curve must have shape \(n, 3\)"),
            ("ab", "curves must be a sequence of curves in space"),
        ],
    )
    def test_wrong_curves_are_refused(self, curves: object, message: str) -> None:
        with pytest.raises(InputError, match=message):
            Diagram.from_curves(curves)  # type: ignore[arg-type]

    @pytest.mark.parametrize("objects", [[1], [0, 0], ["a"], 5])
    def test_wrong_objects_are_refused(self, objects: object) -> None:
        with pytest.raises(InputError, match="object"):
            Diagram.from_result(rope(), objects)  # type: ignore[arg-type]
