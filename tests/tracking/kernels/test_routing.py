"""Routes of a known curve through a frame's curves: against a slow twin, and under changes that must not matter.

Constants are the kernel's own: a twin tells whether the cheapest way is found, not what the prices should be.
"""

from __future__ import annotations

import functools
import math
from typing import NamedTuple

import numpy as np
import pytest
from builders import arc, curve_through, line, part, random_curve, wave
from hypothesis import given
from hypothesis import strategies as st

from dloftbs.data.curve import BSplineCurve
from dloftbs.tracking.kernels import routing as kernels

SAMPLES_PER_NODE = kernels.SAMPLES_PER_NODE
SPACING = 10.0
SLACK = 15.0
REACH = 25.0
TURN = np.array([[0.0, 1.0], [1.0, 0.0]])
MIRROR = np.array([[-1.0, 0.0], [0.0, 1.0]])


def even(curve: BSplineCurve, count: int) -> np.ndarray:
    """Return points evenly spaced along a curve."""
    fine = curve(np.linspace(0.0, 1.0, 4001))
    along = np.concatenate(([0.0], np.cumsum(np.linalg.norm(np.diff(fine, axis=0), axis=1))))
    at = np.linspace(0.0, along[-1], count)
    return np.stack([np.interp(at, along, column) for column in fine.T], axis=1)


def nodes_of(curve: BSplineCurve) -> np.ndarray:
    return even(curve, round(curve.length / SPACING) + 1)


def described(points: np.ndarray) -> np.ndarray:
    """Return samples as the kernel takes them, the tangents yet to be written."""
    return np.column_stack((points, np.full((len(points), 2), np.nan), np.zeros(len(points))))


class Problem(NamedTuple):
    """Arguments of the kernel."""

    nodes: np.ndarray
    reach: np.ndarray
    unseen: np.ndarray
    samples: np.ndarray
    part: np.ndarray
    bounds: np.ndarray
    extra: np.ndarray
    spacing: float = SPACING
    slack: float = SLACK

    def route(self) -> tuple[list[int], float]:
        at = np.zeros(len(self.nodes), np.int64)
        nodes = np.column_stack((self.nodes, self.reach, self.unseen))
        samples = described(self.samples)
        samples[:, 4] = self.extra
        longest = kernels.describe_curves(samples, self.bounds)
        price = kernels.find_route(nodes, samples, self.bounds, longest, self.spacing, self.slack, at)
        return at.tolist(), price

    def moved(self, matrix: np.ndarray) -> Problem:
        return self._replace(nodes=self.nodes @ matrix.T, samples=self.samples @ matrix.T)


def problem_of(nodes: np.ndarray, *curves: BSplineCurve, reach: float = REACH, unseen: float = 1.0) -> Problem:
    shown = [even(curve, math.ceil(SAMPLES_PER_NODE * curve.length / SPACING) + 1) for curve in curves]
    counts = np.array([len(points) for points in shown], np.int64)
    last = np.cumsum(counts)
    samples = np.vstack([np.zeros((0, 2)), *shown])
    return Problem(
        nodes,
        np.full(len(nodes), reach),
        np.full(len(nodes), unseen),
        samples,
        np.repeat(np.arange(len(shown)), counts),
        np.stack((last - counts, last - 1), axis=1),
        np.zeros(len(samples)),
    )


class Twin:
    """The same costs, state by state: a node is a signed sample, or None if it is hidden."""

    def __init__(self, problem: Problem) -> None:
        self.problem = problem
        self.headings = self._directions(problem.nodes, np.zeros(len(problem.nodes), int))
        self.tangents = self._directions(problem.samples, problem.part)
        self.own = [self._near(k) for k in range(len(problem.nodes))]
        self.seen = functools.cache(self._seen)
        self.hidden_cost = functools.cache(self._hidden_cost)

    def cheapest(self) -> float:
        last = len(self.problem.nodes) - 1
        return min(
            self.hidden_cost(last)[0],
            *(self.seen(last, s) + self._edge(s, after=True) for s in self.own[last]),
            math.inf,
        )

    def price_of(self, at: list[int]) -> float:
        """Return the cost of a given route, infinite if it is not allowed."""
        total, last = 0.0, None
        for k, signed in enumerate(at):
            before = at[k - 1] if k else 0
            if signed == 0:
                total += self.problem.unseen[k] + (self._edge(before, after=True) if before else 0.0)
                continue
            total += self.own[k].get(signed, math.inf)
            if before:
                total += self._onward(k, before, signed)
            else:
                total += self._edge(signed, after=False) if self._fits(last, k, signed) else math.inf
            last = k, signed
        return total + (self._edge(at[-1], after=True) if at[-1] else 0.0)

    def mean_of(self, at: list[int]) -> float:
        own = [self.own[k][signed] for k, signed in enumerate(at) if signed]
        return sum(own) / len(own) if own else math.inf

    @staticmethod
    def _directions(points: np.ndarray, part: np.ndarray) -> np.ndarray:
        result = np.zeros((len(points), 2))
        for i in range(len(points)):
            beside = [j for j in (i - 1, i, i + 1) if 0 <= j < len(points) and part[j] == part[i]]
            chord = points[beside[-1]] - points[beside[0]]
            result[i] = chord / (np.linalg.norm(chord) or 1.0)
        return result

    def _near(self, k: int) -> dict[int, float]:
        """Map each candidate of a node, signed, to its cost."""
        problem, found = self.problem, {}
        for i, sample in enumerate(problem.samples):
            off = sample - problem.nodes[k]
            cosine = float(self.tangents[i] @ self.headings[k])
            if math.hypot(*off) <= problem.reach[k] and abs(cosine) >= kernels._MIN_COSINE:
                along = float(off @ self.headings[k])
                across = float(off @ off) - along**2
                squared = across + kernels._ALONG_WEIGHT * along**2
                turned = kernels._TURN_COST * (1.0 - abs(cosine))
                found[i + 1 if cosine > 0 else -i - 1] = squared / problem.reach[k] ** 2 + turned + problem.extra[i]
        return dict(sorted(found.items(), key=lambda sample: sample[1])[: kernels._MAX_CANDIDATES])

    def _edge(self, signed: int, after: bool) -> float:
        """Return the cost of being hidden after a sample, or before it."""
        i = abs(signed) - 1
        first, last = self.problem.bounds[self.problem.part[i]]
        to_end = last - i if (signed > 0) == after else i - first
        room = int(self.problem.slack / (self.problem.spacing / SAMPLES_PER_NODE))
        return kernels._HIDE_AT_END_COST if to_end <= room else kernels._HIDE_INSIDE_COST

    def _onward(self, k: int, before: int, signed: int) -> float:
        """Return the cost of continuing from one sample to the next."""
        j, i = abs(before) - 1, abs(signed) - 1
        gone = (i - j) if signed > 0 else (j - i)
        if self.problem.part[i] == self.problem.part[j] and (before > 0) == (signed > 0) and 2 <= gone <= 6:
            return kernels._SLIP_COST[gone - 2]
        step = self.problem.samples[i] - self.problem.samples[j]
        ahead = float(step @ self.headings[k])
        near = math.hypot(*step) <= 1.75 * self.problem.spacing and ahead >= 0.2 * self.problem.spacing
        return kernels._SWITCH_COST if near else math.inf

    def _fits(self, last: tuple[int, int] | None, k: int, signed: int) -> bool:
        """Tell whether what is hidden since a node was last seen can reach so far, and nothing is seen twice."""
        if last is None:
            return True
        a, before = last
        hidden = (k - a) * self.problem.spacing
        span = self.problem.samples[abs(signed) - 1] - self.problem.samples[abs(before) - 1]
        same = self.problem.part[abs(signed) - 1] == self.problem.part[abs(before) - 1] and (signed > 0) == (before > 0)
        near = math.hypot(*span) <= kernels.MAX_BRIDGE * hidden + self.problem.slack
        return near and not (same and signed <= before)

    def _seen(self, k: int, signed: int) -> float:
        """Return what it costs at least to come to a sample."""
        if k == 0:
            return self.own[0][signed] + self._edge(signed, after=False)
        cost, last = self.hidden_cost(k - 1)
        ways = [cost + self._edge(signed, after=False)] if self._fits(last, k, signed) else []
        ways += [self.seen(k - 1, before) + self._onward(k, before, signed) for before in self.own[k - 1]]
        return min(ways, default=math.inf) + self.own[k][signed]

    def _hidden_cost(self, k: int) -> tuple[float, tuple[int, int] | None]:
        """Return the least cost of being hidden, and where that route was last seen."""
        unseen = self.problem.unseen[k]
        if k == 0:
            return unseen, None
        ways = [self.hidden_cost(k - 1)]
        ways += [(self.seen(k - 1, s) + self._edge(s, after=True), (k - 1, s)) for s in self.own[k - 1]]
        cost, last = min(ways, key=lambda way: way[0])
        return cost + unseen, last


def places(problem: Problem, at: list[int]) -> np.ndarray:
    """Return where the nodes are seen, NaN where they are hidden."""
    return np.array([problem.samples[abs(signed) - 1] if signed else (np.nan, np.nan) for signed in at])


@st.composite
def problems(draw: st.DrawFn) -> Problem:
    """Curves, pieces of them and curves across them, near a known one; some samples claimed."""
    rng = np.random.default_rng(draw(st.integers(0, 10**6)))
    kind = draw(st.sampled_from(("wave", "random", "arc")))
    base = {
        "wave": wave(phase=rng.uniform(0, 6)),
        "random": random_curve(int(rng.integers(1000))),
        "arc": arc(90.0, 4.5),
    }
    whole = base[kind]
    whole = whole.transformed(np.eye(2) * min(1.0, 250.0 / whole.length), [0.0, 0.0])
    shown = []
    for _ in range(draw(st.integers(0, 4))):
        low, high = np.sort(rng.uniform(0.0, 1.0, 2))
        piece = part(whole, low, min(high + 0.1, 1.0)) if rng.random() < 0.7 else whole
        if rng.random() < 0.3:
            middle = whole(rng.uniform(0.0, 1.0))
            off = rng.normal(0.0, 60.0, 2)
            piece = line(tuple(middle - off), tuple(middle + off))
        piece = piece.transformed(np.eye(2), rng.normal(0.0, 5.0, 2))
        if piece.length > 8.0:
            shown.append(piece.reversed() if rng.random() < 0.5 else piece)
    problem = problem_of(nodes_of(whole), *shown, reach=rng.uniform(8.0, 18.0))
    problem.unseen[:] = rng.choice([0.4, 1.0], len(problem.unseen))
    problem.extra[:] = 1.5 * (np.arange(len(problem.extra)) // 20 % 4 == rng.integers(0, 6))
    return problem


def test_curves_are_described_by_their_tangents():
    points = np.random.default_rng(3).normal(0.0, 50.0, (30, 2))
    bounds = np.array([(0, 9), (10, 10), (11, 29)])
    samples = described(points)
    longest = kernels.describe_curves(samples, bounds)
    runs = [points[first : last + 1] for first, last in bounds]
    assert longest == pytest.approx(max(np.hypot(*np.diff(run, axis=0).T).max(initial=0.0) for run in runs))
    part = np.repeat(np.arange(3), [len(run) for run in runs])
    np.testing.assert_allclose(samples[:, 2:4], Twin._directions(points, part))
    assert samples[:, :2].tolist() == points.tolist()


@given(problems())
def test_the_route_is_as_cheap_as_the_slow_twin_s(problem):
    twin = Twin(problem)
    at, price = problem.route()
    assert twin.price_of(at) == pytest.approx(twin.cheapest(), abs=1e-9)
    assert price == pytest.approx(twin.mean_of(at), abs=1e-9)


class TestAlongItself:
    @given(
        st.integers(0, 1000), st.sampled_from([wave(), arc(90.0, 4.5), arc(30.0, 3.0), line((0.0, 0.0), (200.0, 90.0))])
    )
    def test_a_curve_that_moved_a_little_is_seen_all_along(self, seed, curve):
        shift = np.random.default_rng(seed).normal(0.0, 2.0, 2)
        nodes = nodes_of(curve)
        problem = problem_of(nodes, curve.transformed(np.eye(2), shift))
        at, price = problem.route()
        assert min(at) > 0
        assert price < 0.5
        assert np.linalg.norm(places(problem, at) - nodes, axis=1).max() < 8.0 + SPACING / 2.0

    def test_node_by_node_it_is_itself(self):
        curve = wave()
        count = round(curve.length / SPACING)
        problem = problem_of(even(curve, count + 1))._replace(
            samples=even(curve, SAMPLES_PER_NODE * count + 1),
            part=np.zeros(SAMPLES_PER_NODE * count + 1, np.int64),
            bounds=np.array([[0, SAMPLES_PER_NODE * count]]),
            extra=np.zeros(SAMPLES_PER_NODE * count + 1),
        )
        at, price = problem.route()
        assert at == [SAMPLES_PER_NODE * k + 1 for k in range(count + 1)]
        assert price == pytest.approx(0.0, abs=1e-6)

    def test_run_backwards_its_samples_are_negative(self):
        nodes = nodes_of(wave())
        forwards, backwards = problem_of(nodes, wave()), problem_of(nodes, wave().reversed())
        at, price = forwards.route()
        turned, same = backwards.route()
        assert turned == [signed - len(forwards.samples) - 1 for signed in at]
        assert same == pytest.approx(price, abs=1e-9)


class TestWhatDoesNotMatter:
    @pytest.mark.parametrize("matrix", [TURN, MIRROR, 0.5 * np.array([[1.0, -(3.0**0.5)], [3.0**0.5, 1.0]])])
    @given(problems())
    def test_how_the_image_lies(self, matrix, problem):
        at, price = problem.route()
        twin = Twin(problem)
        turned, same = problem.moved(matrix).route()
        assert twin.price_of(turned) == pytest.approx(twin.price_of(at), abs=1e-9)
        assert same == pytest.approx(price, abs=1e-6)

    @given(problems(), st.randoms(use_true_random=False))
    def test_in_which_order_curves_come_and_from_where_they_run(self, problem, random):
        order = list(range(len(problem.bounds)))
        random.shuffle(order)
        at, price = problem.route()
        pieces = [np.arange(problem.bounds[p, 0], problem.bounds[p, 1] + 1)[:: random.choice([1, -1])] for p in order]
        index = np.concatenate([*pieces, np.zeros(0, np.int64)]).astype(np.int64)
        counts = np.array([len(piece) for piece in pieces], np.int64)
        last = np.cumsum(counts)
        shuffled = problem._replace(
            samples=problem.samples[index],
            part=np.repeat(np.arange(len(pieces)), counts),
            bounds=np.stack((last - counts, last - 1), axis=1),
            extra=problem.extra[index],
        )
        other, same = shuffled.route()
        assert same == pytest.approx(price, abs=1e-9)
        np.testing.assert_allclose(places(shuffled, other), places(problem, at))

    @given(problems())
    def test_it_is_the_same_every_time(self, problem):
        assert problem.route() == problem.route()


class TestCrossing:
    @pytest.mark.parametrize("flip", [False, True])
    @pytest.mark.parametrize("angle", [1.2, 1.57, 2.0])
    def test_two_that_swap_their_halves_are_followed_straight_on(self, angle, flip):
        """Each detection runs to the crossing along one and away from it along the other."""
        c, s = math.cos(angle), math.sin(angle)
        ahead, across = np.array([1.0, 0.0]), np.array([c, s])
        first = curve_through(
            np.vstack((np.linspace(-150, -3, 30)[:, None] * ahead, np.linspace(3, 150, 30)[:, None] * across))
        )
        second = curve_through(
            np.vstack((np.linspace(-150, -3, 30)[:, None] * across, np.linspace(3, 150, 30)[:, None] * ahead))
        )
        for way in (ahead, across):
            nodes = np.linspace(-150.0, 150.0, 31)[:, None] * way
            problem = problem_of(nodes, first, second.reversed() if flip else second)
            at, price = problem.route()
            assert 0 not in at
            assert np.linalg.norm(places(problem, at) - nodes, axis=1).max() < 8.0
            assert {int(problem.part[abs(signed) - 1]) for signed in at} == {0, 1}
            assert price < 1.0

    def test_what_goes_on_along_one_curve_does_not_go_over(self):
        """Another one, just as near to where it is expected, crosses and goes along with it."""
        problem = problem_of(np.linspace((0, 0), (300, 0), 31), line((0, 4), (300, -4)), line((0, -4), (300, 4)))
        at, _ = problem.route()
        assert len({int(problem.part[abs(signed) - 1]) for signed in at}) == 1


class TestHidden:
    @pytest.mark.parametrize("missing", [(100.0, 160.0), (40.0, 240.0)])
    @pytest.mark.parametrize("flip", [False, True])
    def test_what_is_missing_is_hidden_and_nothing_else(self, missing, flip):
        low, high = missing
        after = line((high, 0.0), (300.0, 0.0))
        problem = problem_of(
            np.linspace((0, 0), (300, 0), 31), line((0, 0), (low, 0)), after.reversed() if flip else after
        )
        at, price = problem.route()
        hidden = 10.0 * np.flatnonzero(np.array(at) == 0)
        # A node may be seen at what lies farther on, as long as what is hidden remains as long as it was.
        assert low < hidden.min() + SPACING
        assert hidden.max() - SPACING < high
        assert len(hidden) * SPACING <= high - low
        assert len(hidden) * SPACING >= high - low - 4 * SPACING
        assert (np.diff(hidden) == SPACING).all()
        assert price < 1.0

    @pytest.mark.parametrize("end", [0, 1])
    def test_an_end_that_is_missing_is_hidden(self, end):
        nodes = np.linspace((0, 0), (300, 0), 31)
        at, _ = problem_of(nodes, line((80, 0), (300, 0)) if end == 0 else line((0, 0), (220, 0))).route()
        hidden = np.flatnonzero(np.array(at) == 0)
        assert hidden.tolist() in (
            [list(range(n)) for n in (6, 7, 8)] if end == 0 else [list(range(n, 31)) for n in (23, 24, 25)]
        )

    def test_nothing_is_seen_twice(self):
        """A short part between two that are hidden lies at its place once, however much is missing around it."""
        problem = problem_of(
            np.linspace((0, 0), (300, 0), 31), line((20, 0), (60, 0)), line((120, 0), (300, 0)), unseen=3.0
        )
        at, _ = problem._replace(slack=30.0).route()
        assert (np.diff([signed for signed in at if signed]) > 0).all()

    def test_what_lies_too_far_on_is_not_the_rest(self):
        """Between the two there would be more than the cable has."""
        rest = line((205.0, 18.0), (300.0, 18.0))
        nodes = np.vstack((np.linspace((0, 0), (150, 0), 16), np.linspace((160, 0), (160, -140), 15)))
        at, _ = problem_of(nodes, line((0, 0), (150, 0)), rest).route()
        assert at[-10:] == [0] * 10

    @pytest.mark.parametrize("curves", [[], [wave((0.0, 300.0))], [line((200.0, -300.0), (200.0, 300.0))]])
    def test_where_nothing_runs_along_all_is_hidden(self, curves):
        problem = problem_of(np.linspace((0, 0), (300, 0), 31), *curves)
        at, price = problem.route()
        assert at == [0] * 31
        assert price == math.inf

    def test_out_of_reach_by_a_little_is_out_of_reach(self):
        nodes = np.linspace((0, 0), (300, 0), 31)
        assert 0 not in problem_of(nodes, line((0, 0.95 * REACH), (300, 0.95 * REACH))).route()[0]
        assert set(problem_of(nodes, line((0, 1.05 * REACH), (300, 1.05 * REACH))).route()[0]) == {0}


class TestTaken:
    def test_the_free_one_of_two_is_chosen_though_it_is_farther(self):
        nodes = np.linspace((0, 0), (300, 0), 31)
        problem = problem_of(nodes, line((0, 2), (300, 2)), line((0, -10), (300, -10)))
        assert {int(problem.part[abs(signed) - 1]) for signed in problem.route()[0]} == {0}
        problem.extra[problem.part == 0] = 1.5
        assert {int(problem.part[abs(signed) - 1]) for signed in problem.route()[0]} == {1}

    def test_what_another_one_has_taken_all_along_is_left_to_it(self):
        problem = problem_of(np.linspace((0, 0), (300, 0), 31), line((0, 0), (300, 0)))
        problem.extra[:] = 1.5
        assert set(problem.route()[0]) == {0}

    def test_a_few_taken_samples_are_passed_over(self):
        problem = problem_of(np.linspace((0, 0), (300, 0), 31), line((0, 0), (300, 0)))
        problem.extra[56:66] = 1.5
        assert 0 not in problem.route()[0]


@pytest.mark.parametrize("flip", [False, True])
def test_where_samples_are_sparse_none_is_passed_over(flip):
    """A short curve beside long ones has denser nodes than their samples are made for."""
    curve = line((0.0, 0.0), (1000.0, 0.0))
    problem = problem_of(
        np.linspace((600, 0), (630, 0), 7), curve.reversed() if flip else curve, reach=12.0, unseen=3.0
    )
    at, price = problem._replace(spacing=5.0).route()
    assert 0 not in at
    assert price < 0.1


def test_a_node_in_a_crowd_is_seen_at_what_fits_best():
    """More samples are near than are looked at, whichever of them come first."""
    crowd = [line((0.0, y), (300.0, y)) for y in np.linspace(-20.0, 20.0, 9) if abs(y) > 1.0]
    problem = problem_of(np.linspace((0, 0), (300, 0), 31), *crowd, line((0.0, 0.5), (300.0, 0.5)))
    at, price = problem.route()
    assert {int(problem.part[abs(signed) - 1]) for signed in at} == {len(crowd)}
    assert price < 0.01


@pytest.mark.parametrize("frameless_s", [0.0, 0.1])
@pytest.mark.parametrize("count", [2, 5, 64, 120])
def test_nodes_lie_evenly_along_the_curve_and_reach_farther_where_it_is_unseen(count: int, frameless_s: float) -> None:
    rng = np.random.default_rng(count)
    predicted, unseen_s = rng.normal(size=(64, 2)), np.maximum(rng.normal(size=64), 0.0)
    reach = 8.0 * np.minimum(1.0 + 4.0 * (unseen_s + frameless_s), 3.0)
    hidden = np.where(unseen_s > 0.0, 0.4, 1.0)
    even, at = np.linspace(0.0, 1.0, 64), np.linspace(0.0, 1.0, count)
    expected = [np.interp(at, even, column) for column in (*predicted.T, reach, hidden)]
    nodes = kernels.place_nodes(predicted, unseen_s, frameless_s, 8.0, count)
    np.testing.assert_allclose(nodes, np.stack(expected, axis=1), rtol=0.0, atol=1e-12)
