"""Random projections of curves in space: codes, simplification and invariants, against spherogram where it is there."""

from __future__ import annotations

import math
from itertools import combinations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from dloftbs.topology import Diagram
from dloftbs.topology.knot_type import alexander_polynomial, determinant
from dloftbs.topology.reidemeister import reduce

SEEDS = st.integers(0, 2**31)


def projection(seed: int, strands: int = 1, closed: bool = True) -> Diagram:
    """Return a random projection of straight sides in space, of up to 40 crossings."""
    rng = np.random.default_rng(seed)
    while True:
        corners = [rng.normal(size=(int(rng.integers(5, 22 // strands + 2)), 3)) for _ in range(strands)]
        diagram = Diagram.from_curves(corners, closed=closed)
        if 3 <= len(diagram.turns) <= 40:
            return diagram


def linking(diagram: Diagram) -> dict[tuple[int, int], int]:
    """Return the linking numbers, of the signs alone."""
    owners = {n: {s for s, strand in enumerate(diagram.passes) if n in strand} for n in range(len(diagram.turns))}
    return {
        pair: sum(diagram.signs[n] for n, both in owners.items() if both == set(pair)) // 2
        for pair in combinations(range(len(diagram.passes)), 2)
    }


@given(SEEDS, st.integers(1, 3), st.booleans())
@settings(max_examples=40, deadline=None)
def test_codes_come_back(seed: int, strands: int, closed: bool) -> None:
    drawn = projection(seed, strands, closed).close(True)
    back = Diagram.from_gauss_code(drawn.gauss_code, drawn.signs)
    assert back.pd_code == drawn.pd_code
    assert (back.signs, back.passes) == (drawn.signs, drawn.passes) or back.writhe == drawn.writhe
    if all(strand and min(strand) < 0 for strand in drawn.gauss_code):
        again = Diagram.from_pd_code(drawn.pd_code)
        assert (again.signs, len(again.passes)) == (drawn.signs, strands)


@given(SEEDS, st.integers(1, 3))
@settings(max_examples=40, deadline=None)
def test_moves_change_no_invariant(seed: int, strands: int) -> None:
    diagram = projection(seed, strands)
    simplified, moves = vars(diagram.simplify()).values()
    assert simplified.linking_numbers == diagram.linking_numbers == linking(diagram)
    assert simplified.alexander_polynomial == diagram.alexander_polynomial
    if all(diagram.passes):
        assert alexander_polynomial(diagram._map()) == diagram.alexander_polynomial
    removed = sum(len(move.crossings) for move in moves if move.kind != "III")
    assert len(diagram.turns) - removed == len(simplified.turns)


@given(SEEDS)
@settings(max_examples=30, deadline=None)
def test_the_view_does_not_matter(seed: int) -> None:
    rng = np.random.default_rng(seed)
    corners = [rng.normal(size=(9, 3)) for _ in range(2)]
    turn, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    turn *= np.sign(np.linalg.det(turn))
    one, other = (Diagram.from_curves([points @ way for points in corners], closed=True) for way in (np.eye(3), turn))
    assert one.linking_numbers == other.linking_numbers
    assert one.part([0]).alexander_polynomial == other.part([0]).alexander_polynomial
    assert one.is_knotted is other.is_knotted
    mirrored = Diagram.from_curves([points * (1, 1, -1) for points in corners], closed=True)
    assert mirrored.linking_numbers == {pair: -n for pair, n in one.linking_numbers.items()}


@given(SEEDS, st.integers(0, 3))
@settings(max_examples=30, deadline=None)
def test_unknown_orders_give_no_answer_that_a_reading_contradicts(seed: int, count: int) -> None:
    diagram = projection(seed, closed=seed % 2 == 0)
    tops = tuple([None if n < count else top for n, top in enumerate(diagram.tops)])
    unsure = Diagram(diagram.passes, diagram.closed, diagram.turns, tops)
    assert unsure.is_knotted in (None, diagram.is_knotted)
    assert unsure.probability == 0.5**count


@given(SEEDS)
@settings(max_examples=30, deadline=None)
def test_the_moves_of_an_open_cable_keep_its_ends(seed: int) -> None:
    diagram = projection(seed, closed=False)
    simplified = diagram.simplify().diagram
    for over in (True, False):
        assert simplified.close(over).alexander_polynomial == diagram.close(over).alexander_polynomial
    assert {move.kind for move in diagram.simplify().moves} <= {"I", "II", "III"}
    assert set(simplified.labels) <= set(diagram.labels)


@given(SEEDS)
@settings(max_examples=30, deadline=None)
def test_drawing_ends_back_undoes_every_cable(seed: int) -> None:
    diagram, drawn = projection(seed, 2, closed=False), 0
    while (move := diagram.next_move) is not None:
        left = diagram.simplify().diagram._map()
        left.erase(move.crossing)
        diagram, drawn = diagram._changed(left), drawn + 1
    assert diagram.simplify().diagram.turns == ()
    assert drawn <= 40


@given(st.integers(0, 5), SEEDS)
@settings(max_examples=40, deadline=None)
def test_the_determinant_is_that_of_numpy(size: int, seed: int) -> None:
    rows = np.random.default_rng(seed).integers(-3, 4, (size, size))
    assert determinant(rows.tolist()) == round(np.linalg.det(rows)) if size else determinant([]) == 1


def test_the_determinant_of_a_band_in_random_order_is_that_of_its_recurrence() -> None:
    size, rng = 500, np.random.default_rng(1)
    band = 3 * np.eye(size, dtype=int) + np.eye(size, k=1, dtype=int) - np.eye(size, k=-1, dtype=int)
    before, expected = 1, 3
    for _ in range(size - 1):
        before, expected = expected, 3 * expected + before
    rows = band[rng.permutation(size)][:, rng.permutation(size)].tolist()
    assert abs(determinant(rows)) == expected


def test_a_third_move_helps_where_the_others_do_not() -> None:
    found = [projection(seed, closed=seed % 2 == 0) for seed in range(300)]
    helped = [one for one in found if any(move.kind == "III" for move in one.simplify().moves)]
    assert helped
    for diagram in helped:
        reduced = diagram._map()
        reduce(reduced, slides=0)
        assert len(diagram.simplify().diagram.turns) < len(reduced.signs)


def test_a_crossing_that_joins_two_parts_is_not_taken_for_minimal() -> None:
    """Such a diagram alternates after the first moves, and a face meets its crossing twice."""
    code = [
        [-1, 5, 6, -10, -7, 8, 9, -3, 2, -4],
        [1, -11, 12, -13, 7, -8, -15, -14, -2, -16],
        [3, 16, 4, 11, -12, 14, -17, -9, -5, -6, 10, 13, 15, 17],
    ]
    signs = [-1, -1, 1, -1, 1, -1, 1, 1, -1, -1, 1, 1, -1, 1, 1, -1, -1]
    assert len(Diagram.from_gauss_code(code, signs).simplify().diagram.turns) == 4


class TestOracle:
    @given(SEEDS, st.integers(1, 3), st.booleans())
    @settings(max_examples=60, deadline=None)
    def test_spherogram_says_the_same(self, seed: int, strands: int, closed: bool) -> None:
        spherogram = pytest.importorskip("spherogram")
        from spherogram.links.seifert import seifert_matrix

        drawn = projection(seed, strands, closed).close(True)
        link = spherogram.Link([list(crossing) for crossing in drawn.pd_code])
        assert link.writhe() == drawn.writhe  # whatever the direction is of what lies over everything
        assert len(link.link_components) == strands
        link.simplify("level")
        simplified = drawn.simplify().diagram
        assert len(simplified.turns) <= len(link.crossings)
        if strands == 1 and link.crossings:
            matrix = np.array(seifert_matrix(link), dtype=object)
            values = [determinant((matrix - t * matrix.T).tolist()) for t in (-1, 2, 3)]
            found = [sum(c * t**k for k, c in enumerate(drawn.alexander_polynomial)) for t in (-1, 2, 3)]
            assert abs(values[0]) == drawn.determinant
            for t, value, one in zip((-1, 2, 3), values, found, strict=True):
                # Equal up to a sign and powers of t.
                ratio = abs(value) / abs(one)
                assert math.isclose(ratio, abs(t) ** round(math.log(ratio, abs(t))) if abs(t) > 1 else 1.0)
