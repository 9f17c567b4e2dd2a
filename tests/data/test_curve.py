"""The curve against the textbook recursion, against scipy, and against lines and circles."""

from __future__ import annotations

import contextlib
import copy
import itertools
import pickle

import numpy as np
import pytest
from builders import arc, bent, curve_through, line, loop, random_curve, through_json, wave
from hypothesis import given
from hypothesis import strategies as st
from scipy.interpolate import BSpline

from dloftbs.data.curve import BSplineCurve
from dloftbs.errors import InputError

U = np.linspace(0.0, 1.0, 41)
KNOTS = [0.0, 0.0, 0.0, 0.0, 0.5, 1.0, 1.0, 1.0, 1.0]
CONTROL = np.arange(10.0).reshape(5, 2) ** 2

curves = st.builds(
    random_curve,
    st.integers(0, 10_000),
    ndim=st.sampled_from([2, 3]),
    closed=st.booleans(),
    degree=st.sampled_from([3]),
)


def basis(knots: np.ndarray, i: int, degree: int, u: float) -> float:
    """The recursion of Cox and de Boor; an interval holds its left end, and the last one both."""
    if degree == 0:
        last = knots[i] < knots[i + 1] == 1.0 == u
        return float(knots[i] <= u < knots[i + 1] or last)
    value = 0.0
    if (rise := knots[i + degree] - knots[i]) > 0:
        value += (u - knots[i]) / rise * basis(knots, i, degree - 1, u)
    if (fall := knots[i + degree + 1] - knots[i + 1]) > 0:
        value += (knots[i + degree + 1] - u) / fall * basis(knots, i + 1, degree - 1, u)
    return value


def by_recursion(curve: BSplineCurve, u: float) -> np.ndarray:
    weights = [basis(curve.knots, i, curve.degree, u) for i in range(len(curve.control_points))]
    return np.array(weights) @ curve.control_points


class TestEvaluation:
    @pytest.mark.parametrize("degree", [1, 2, 3, 4])
    @pytest.mark.parametrize("seed", range(3))
    def test_points_are_those_of_the_recursion(self, seed, degree):
        curve = random_curve(seed, degree=degree)
        expected = [by_recursion(curve, u) for u in U]
        np.testing.assert_allclose(curve(curve.u_at(U)), expected, rtol=0, atol=1e-6)
        np.testing.assert_allclose(curve.spline(U), expected, rtol=0, atol=1e-9)

    @given(st.integers(0, 10_000))
    def test_points_of_a_loop_are_those_of_the_recursion(self, seed):
        curve = random_curve(seed, closed=True)
        t = np.linspace(0.0, 0.99, 12)
        np.testing.assert_allclose(curve.spline(t), [by_recursion(curve, v) for v in t], rtol=0, atol=1e-9)

    @given(curves)
    def test_derivatives_are_those_by_the_length(self, curve):
        t = curve.t_at(U[:-1])
        spline = BSpline(curve.knots.copy(), curve.control_points.copy(), 3)
        velocity, change = spline(t, nu=1), spline(t, nu=2)
        rate = curve.length / np.linalg.norm(velocity, axis=1, keepdims=True)  # dt / du
        # The chain rule, and d(rate) / dt by the quotient rule.
        growth = -(rate**3) * (velocity * change).sum(axis=1, keepdims=True) / curve.length**2
        np.testing.assert_allclose(curve(U[:-1], 1), velocity * rate, rtol=1e-9, atol=1e-9)
        second = change * rate**2 + velocity * growth * rate
        np.testing.assert_allclose(curve(U[:-1], 2), second, rtol=1e-6, atol=1e-9 * np.abs(second).max())

    @given(curves)
    def test_the_scipy_spline_is_the_same_curve(self, curve):
        assert isinstance(curve.spline, BSpline)
        np.testing.assert_array_equal(curve.spline(curve.t_at(U)), curve(U))

    @pytest.mark.parametrize("derivative", [3, -1, 1.0])
    def test_derivatives_by_the_length_are_two(self, derivative):
        with pytest.raises(InputError, match=r"derivative must be an integer in 0\.\.2"):
            wave()(0.5, derivative)

    @pytest.mark.parametrize("shape", [(), (0,), (1,), (7,), (2, 3)])
    @pytest.mark.parametrize("ndim", [2, 3])
    def test_leading_axes_are_those_of_u(self, shape, ndim):
        curve = random_curve(0, ndim)
        u = np.full(shape, 0.5)
        assert curve(u).shape == curve.tangent(u).shape == (*shape, ndim)
        assert curve.curvature(u).shape == shape

    def test_u_may_be_a_plain_number_or_list(self):
        curve = wave()
        np.testing.assert_array_equal(curve([0, 1]), np.stack((curve(0), curve(1.0))))

    def test_an_open_curve_is_led_on_straight_where_it_is_straight(self):
        led_on = line((0, 0), (30, 40))([-0.5, 1.5], extrapolate=True)
        np.testing.assert_allclose(led_on, [[-15, -20], [45, 60]], atol=1e-9)

    @given(st.integers(0, 10_000))
    def test_a_loop_starts_again_beyond_its_seam(self, seed):
        curve = random_curve(seed, closed=True)
        for derivative in range(3):
            around = curve(U, derivative)
            for turns in (-1.0, 1.0, 2.0):
                scale = np.abs(around).max()
                # A hairpin turns within a millionth of the length, and so do its derivatives.
                away = np.abs(curve(U + turns, derivative) - around).max(axis=1)
                assert np.median(away) < 1e-9 * scale
                assert derivative or away.max() < 1e-9 * scale

    @given(curves)
    def test_samples_are_evenly_spaced_in_u_with_both_ends(self, curve):
        np.testing.assert_array_equal(curve.sample(5), curve([0.0, 0.25, 0.5, 0.75, 1.0]))
        np.testing.assert_array_equal(curve.sample(2), curve([0.0, 1.0]))

    def test_an_open_curve_ends_at_its_outer_control_points(self):
        curve = random_curve(4)
        np.testing.assert_allclose(curve.sample(2), curve.control_points[[0, -1]], atol=1e-12)

    @pytest.mark.parametrize("n", [1, 0, -3, 2.0, "5", True, 10**400, 10**12])
    def test_a_sample_of_less_than_two_is_refused(self, n):
        with pytest.raises(InputError, match=r"n must be an integer in 2\.\."):
            wave().sample(n)


class TestClosedForms:
    @pytest.mark.parametrize("radius", [1e-3, 1.0, 250.0])
    @pytest.mark.parametrize("angle", [0.5, np.pi, 6.0])
    def test_an_arc(self, radius, angle):
        centre = (3.0 * radius, -radius)
        curve = arc(radius, angle, centre)
        spokes = (curve(U) - centre) / radius
        phi = angle * U
        np.testing.assert_allclose(spokes, np.stack((np.cos(phi), np.sin(phi)), axis=1), atol=1e-5)
        np.testing.assert_allclose(curve.tangent(U), np.stack((-np.sin(phi), np.cos(phi)), axis=1), atol=1e-4)
        np.testing.assert_allclose(curve.curvature(U) * radius, 1.0, rtol=2e-2)
        np.testing.assert_allclose(curve.curvature(U[5:-5]) * radius, 1.0, rtol=2e-3)
        assert curve.length == pytest.approx(radius * angle, rel=1e-6)

    @pytest.mark.parametrize("radius", [0.02, 60.0])
    def test_a_loop(self, radius):
        curve = loop(radius, (5.0, 7.0))
        assert curve.closed
        assert curve.length == pytest.approx(2 * np.pi * radius, rel=1e-6)
        np.testing.assert_allclose(np.linalg.norm(curve(U) - (5.0, 7.0), axis=1), radius, rtol=1e-6)
        np.testing.assert_allclose(curve.curvature(U) * radius, 1.0, rtol=2e-3)

    def test_a_helix(self):
        radius, pitch = 40.0, 15.0
        phi = np.linspace(0.0, 9.0, 300)
        curve = curve_through(np.stack((radius * np.cos(phi), radius * np.sin(phi), pitch * phi), axis=1))
        squared = radius**2 + pitch**2
        assert curve.length == pytest.approx(9.0 * np.sqrt(squared), rel=1e-6)
        np.testing.assert_allclose(curve.curvature(U[5:-5]), radius / squared, rtol=2e-3)
        np.testing.assert_allclose(curve.tangent(U)[:, 2], pitch / np.sqrt(squared), rtol=1e-4)

    @pytest.mark.parametrize(("end", "length"), [((60.0, 80.0), 100.0), ((2.0, 3.0, 6.0), 7.0)])
    def test_a_straight_line(self, end, length):
        curve = line(tuple(0.0 for _ in end), end)
        assert curve.ndim == len(end)
        assert curve.length == pytest.approx(length, rel=1e-12)
        np.testing.assert_allclose(curve(U), U[:, None] * end, atol=1e-9)
        np.testing.assert_allclose(curve.tangent(U), np.tile(np.array(end) / length, (len(U), 1)), atol=1e-9)
        np.testing.assert_allclose(curve.curvature(U), 0.0, atol=1e-8)

    @pytest.mark.parametrize("size", [0.01, 1.0, 300.0])
    def test_a_parabola_whose_speed_varies(self, size):
        curve = BSplineCurve([0, 0, 0, 1, 1, 1], np.array([[0, 0], [0.5, 0], [1, 1]]) * size, 2)  # y = x^2
        u = (U * np.sqrt(1.0 + 4.0 * U**2) / 2 + np.arcsinh(2.0 * U) / 4) / (np.sqrt(5.0) / 2 + np.arcsinh(2.0) / 4)
        np.testing.assert_allclose(curve(u), np.stack((U, U**2), axis=1) * size, atol=1e-5 * size)
        np.testing.assert_allclose(curve.curvature(u) * size, 2.0 / (1.0 + 4.0 * U**2) ** 1.5, rtol=1e-4)
        assert curve.length == pytest.approx(size * (np.sqrt(5.0) / 2 + np.arcsinh(2.0) / 4), rel=1e-5)

    def test_a_curve_that_stands_still_has_no_direction_and_no_bend(self):
        curve = BSplineCurve(KNOTS, np.zeros((5, 2)))
        assert curve.length == 0.0
        np.testing.assert_array_equal(curve.tangent(U), np.zeros((len(U), 2)))
        np.testing.assert_array_equal(curve.curvature(U), np.zeros(len(U)))

    @given(curves)
    def test_tangents_are_of_length_one(self, curve):
        np.testing.assert_allclose(np.linalg.norm(curve.tangent(U), axis=1), 1.0, rtol=1e-12)


class TestReversed:
    @given(curves)
    def test_u_runs_the_other_way(self, curve):
        np.testing.assert_allclose(curve.reversed()(U), curve(1.0 - U), rtol=0, atol=1e-9)

    @given(curves)
    def test_tangents_point_the_other_way(self, curve):
        u = U[1:-1]
        np.testing.assert_allclose(curve.reversed().tangent(u), -curve.tangent(1.0 - u), rtol=0, atol=1e-6)

    @given(curves)
    def test_twice_is_the_identity(self, curve):
        twice = curve.reversed().reversed()
        np.testing.assert_array_equal(twice.control_points, curve.control_points)
        np.testing.assert_allclose(twice.knots, curve.knots, rtol=0, atol=1e-15)
        assert (twice.degree, twice.closed) == (curve.degree, curve.closed)

    @given(curves)
    def test_the_result_passes_the_checks_of_the_constructor(self, curve):
        back = curve.reversed()
        assert BSplineCurve(back.knots, back.control_points, back.degree, closed=back.closed) == back
        assert back.length == pytest.approx(curve.length, rel=1e-9)


class TestTransformed:
    @given(curves, st.floats(-np.pi, np.pi))
    def test_a_turn_moves_the_points_and_keeps_the_shape(self, curve, angle):
        matrix = np.eye(curve.ndim)
        matrix[:2, :2] = [[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]]
        offset = np.arange(1.0, 1.0 + curve.ndim)
        turned = curve.transformed(matrix, offset)
        np.testing.assert_allclose(turned(U), curve(U) @ matrix.T + offset, rtol=0, atol=1e-9)
        assert turned.length == pytest.approx(curve.length, rel=1e-9)
        assert turned.closed == curve.closed

    @given(curves, st.floats(-np.pi, np.pi))
    def test_a_homogeneous_matrix_does_the_same(self, curve, angle):
        pose = np.eye(curve.ndim + 1)
        pose[:2, :2] = [[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]]
        pose[:-1, -1] = np.arange(1.0, 1.0 + curve.ndim)
        assert curve.transformed(pose) == curve.transformed(pose[:-1, :-1], pose[:-1, -1])
        np.testing.assert_allclose(curve.transformed(pose).transformed(np.linalg.inv(pose))(U), curve(U), atol=1e-6)

    @pytest.mark.parametrize(
        ("matrix", "message"),
        [
            (np.eye(2), r"without an offset, matrix must have shape \(3, 3\), got \(2, 2\)"),
            (np.eye(4), r"without an offset, matrix must have shape \(3, 3\), got \(4, 4\)"),
            (np.array([[1, 0, 0], [0, 1, 0], [0.1, 0, 1]]), "the last row of a homogeneous matrix must be 0 0 1, got"),
            (np.full((3, 3), np.nan), "matrix must be finite"),
        ],
    )
    def test_what_is_no_pose_is_refused(self, matrix, message):
        with pytest.raises(InputError, match=message):
            wave().transformed(matrix)

    def test_a_plane_curve_can_be_laid_into_space(self):
        curve = wave()
        lifted = curve.transformed([[1, 0], [0, 1], [0, 0]], [0, 0, 0.7])
        assert lifted.ndim == 3
        np.testing.assert_allclose(lifted(U), np.column_stack((curve(U), np.full(len(U), 0.7))), atol=1e-12)


class TestConstruction:
    @pytest.mark.parametrize(
        ("changes", "message"),
        [
            ({"control_points": np.ones((5, 4))}, r"control_points must have shape \(n, 2\) or \(n, 3\), got \(5, 4\)"),
            ({"control_points": np.ones(5)}, r"control_points must have shape .* got \(5,\)"),
            ({"control_points": [[1.0, np.nan]] * 5}, "control_points must be finite, got 5 values"),
            ({"control_points": [[1.0, 2.0], [3.0]]}, "control_points must be an array of numbers"),
            ({"control_points": None}, "control_points must be"),
            ({"control_points": [["1", "2"]] * 5}, "control_points must be an array of numbers, got .* of <U1"),
            ({"control_points": CONTROL > 0}, "control_points must be an array of numbers, got .* of bool"),
            ({"control_points": CONTROL * 1j}, "control_points must be an array of numbers, got .* of complex128"),
            ({"control_points": CONTROL.astype("m8[s]")}, "control_points must be an array of numbers"),
            ({"control_points": [[10**400, 0]] * 5}, "control_points must be an array of numbers"),
            ({"control_points": CONTROL * 1e300}, r"control_points must be at most 1e\+12, got"),
            ({"control_points": np.ones((3, 2))}, "degree 3 needs 4 control points or more, got 3"),
            ({"knots": KNOTS[1:]}, r"knots must have shape \(9,\), got \(8,\)"),
            ({"knots": [KNOTS]}, r"knots must have shape \(9,\), got \(1, 9\)"),
            ({"knots": [0, 0, 0, 0, np.inf, 1, 1, 1, 1]}, "knots must be finite, got 1 "),
            ({"knots": [0, 0, 0, 0, 0.5, 1, 1, 1, 0.9]}, "knots must not decrease"),
            (
                {"knots": [0, 0, 0, 0, 0.5, 2, 2, 2, 2]},
                r"span 0 to 1 between knots\[3\] and knots\[5\], got \(0.0, 2.0\)",
            ),
            ({"knots": [0, 0, 0, 0.1, 0.5, 1, 1, 1, 1]}, r"got \(0.1, 1.0\)"),
            ({"knots": [0, 0, 0, 0, 1e-300, 1, 1, 1, 1]}, "knots must be the same or at least 1e-12 apart, got 1e-300"),
            ({"knots": [0, 0, 0, 0, 0, 1, 1, 1, 1]}, "no more than 4 knots may be the same"),
            ({"knots": [-1e300, 0, 0, 0, 0.5, 1, 1, 1, 1]}, "knots must be at most"),
            ({"closed": "no"}, "closed must be True or False, got 'no'"),
            ({"degree": 0}, "degree must be an integer in 1..9, got 0"),
            ({"degree": 10**5000}, "degree must be .* got an integer of thousands of digits"),
            ({"degree": 3.0}, "degree must be .* got 3.0"),
            ({"degree": True}, "degree must be .* got True"),
        ],
    )
    def test_what_is_wrong_is_said_with_what_came(self, changes, message):
        with pytest.raises(InputError, match=message):
            BSplineCurve(**{"knots": KNOTS, "control_points": CONTROL, **changes})

    def test_the_fields_are_what_was_given(self):
        curve = BSplineCurve(KNOTS, CONTROL.astype(int).tolist(), np.int64(3))
        np.testing.assert_array_equal(curve.knots, KNOTS)
        np.testing.assert_array_equal(curve.control_points, CONTROL)
        assert (curve.degree, type(curve.degree), curve.closed, curve.ndim) == (3, int, False, 2)
        assert curve.knots.dtype == curve.control_points.dtype == np.float64

    def test_the_caller_s_arrays_stay_his_own(self):
        knots, control = np.array(KNOTS), CONTROL.copy()
        curve = BSplineCurve(knots, control)
        knots[4], control[0, 0] = 0.25, 99.0
        assert curve.knots[4] == 0.5
        assert curve.control_points[0, 0] == CONTROL[0, 0]

    def test_the_unchecked_constructor_copies_nothing(self):
        knots, control = np.array(KNOTS), CONTROL.copy()
        curve = BSplineCurve._unchecked(knots, control, 3, False)
        assert curve.knots is knots
        assert curve.control_points is control
        assert curve == BSplineCurve(KNOTS, CONTROL)

    @pytest.mark.parametrize("order", ["C", "F"])
    def test_the_memory_order_of_the_control_points_is_of_no_account(self, order):
        curve = BSplineCurve(KNOTS, np.array(CONTROL, order=order))
        np.testing.assert_array_equal(curve(U), BSplineCurve(KNOTS, CONTROL)(U))


def origins():
    curve = BSplineCurve(KNOTS, CONTROL)
    yield pytest.param(curve, id="checked")
    yield pytest.param(BSplineCurve._unchecked(np.array(KNOTS), CONTROL.copy(), 3, False), id="unchecked")
    yield pytest.param(curve.reversed(), id="reversed")
    yield pytest.param(curve.transformed(np.eye(2), (1, 1)), id="transformed")
    yield pytest.param(BSplineCurve.from_dict(curve.to_dict()), id="from_dict")
    yield pytest.param(pickle.loads(pickle.dumps(curve)), id="pickled")
    yield pytest.param(copy.deepcopy(curve), id="copied")


class TestImmutability:
    @pytest.mark.parametrize("curve", list(origins()))
    @pytest.mark.parametrize("name", ["knots", "control_points"])
    def test_the_arrays_are_read_only(self, curve, name):
        with pytest.raises(ValueError, match="read-only"):
            getattr(curve, name)[0] = 0.0

    @pytest.mark.parametrize("name", ["knots", "control_points", "degree", "closed", "ndim", "length", "spline", "new"])
    def test_no_attribute_can_be_set_or_deleted(self, name):
        curve = BSplineCurve(KNOTS, CONTROL)
        length = curve.length
        with pytest.raises(AttributeError):
            setattr(curve, name, 1)
        with pytest.raises(AttributeError):
            delattr(curve, name)
        assert curve.length == length

    def test_changing_the_scipy_spline_does_not_reach_the_curve(self):
        curve = BSplineCurve(KNOTS, CONTROL)
        before = curve.control_points.copy()
        with contextlib.suppress(ValueError):  # a read-only array is as good as a copy
            curve.spline.c[:] = 0.0
        np.testing.assert_array_equal(curve.control_points, before)


class TestEquality:
    @given(curves)
    def test_equal_curves_have_equal_hashes(self, curve):
        twin = BSplineCurve(curve.knots, curve.control_points, curve.degree, closed=curve.closed)
        assert twin == curve
        assert hash(twin) == hash(curve)
        assert len({twin, curve}) == 1

    def test_negative_zero_is_zero(self):
        zeros = np.zeros((5, 2))
        assert BSplineCurve(KNOTS, zeros) == BSplineCurve(KNOTS, -zeros)
        assert hash(BSplineCurve(KNOTS, zeros)) == hash(BSplineCurve(KNOTS, -zeros))

    @pytest.mark.parametrize(
        "changes",
        [
            {"knots": [0, 0, 0, 0, 0.6, 1, 1, 1, 1]},
            {"control_points": CONTROL + 1e-9},
            {"control_points": np.column_stack((CONTROL, CONTROL[:, 0]))},
            {"closed": True},
        ],
    )
    def test_a_curve_that_differs_in_anything_is_another(self, changes):
        assert BSplineCurve(KNOTS, CONTROL) != BSplineCurve(**{"knots": KNOTS, "control_points": CONTROL, **changes})

    def test_a_curve_is_no_other_thing(self):
        assert BSplineCurve(KNOTS, CONTROL) != "curve"
        assert BSplineCurve(KNOTS, CONTROL) != CONTROL.tolist()


class TestSerialisation:
    @given(curves)
    def test_nothing_is_lost_on_the_way_through_json(self, curve):
        back = BSplineCurve.from_dict(through_json(curve.to_dict()))
        assert back == curve
        assert back.length == curve.length

    def test_the_dictionary_says_what_there_is(self):
        data = loop(10.0).to_dict()
        assert list(data) == ["degree", "closed", "knots", "control_points", "length"]
        assert (data["degree"], data["closed"]) == (3, True)
        assert data["length"] == pytest.approx(20 * np.pi, rel=1e-6)

    @pytest.mark.parametrize("key", ["degree", "closed", "knots", "control_points"])
    def test_a_missing_key_is_named(self, key):
        data = wave().to_dict()
        del data[key]
        with pytest.raises(InputError, match=f"needs the key '{key}', got"):
            BSplineCurve.from_dict(data)

    @pytest.mark.parametrize("data", [None, 5, "knots", [], [("knots", [])]])
    def test_what_is_no_dictionary_is_refused(self, data):
        with pytest.raises(InputError, match="a curve needs a dictionary as of to_dict, got"):
            BSplineCurve.from_dict(data)

    @pytest.mark.parametrize("value", [None, "x", {}, 10**400, [[]], float("nan")])
    @pytest.mark.parametrize("key", ["degree", "closed", "knots", "control_points"])
    def test_garbage_is_refused(self, key, value):
        with pytest.raises(InputError, match=key):
            BSplineCurve.from_dict({**wave().to_dict(), key: value})

    @pytest.mark.parametrize(
        ("matrix", "offset", "message"),
        [
            (np.eye(3), [0, 0], r"matrix must have shape \(2, 2\), got \(3, 3\)"),
            (np.eye(2), [0, np.nan], "offset must be finite"),
            (np.eye(2) * 1e12, [0, 0], "control_points must be at most"),
            ("x", [0, 0], "matrix must be an array of numbers"),
        ],
    )
    def test_a_map_of_another_space_is_refused(self, matrix, offset, message):
        with pytest.raises(InputError, match=message):
            wave().transformed(matrix, offset)

    def test_wrong_values_are_refused(self):
        with pytest.raises(InputError, match="knots must have shape"):
            BSplineCurve.from_dict({**wave().to_dict(), "knots": [0.0, 1.0]})

    @given(curves)
    def test_a_curve_comes_whole_out_of_another_process(self, curve):
        assert pickle.loads(pickle.dumps(curve)) == curve
        assert copy.deepcopy(curve) == curve

    def test_a_curve_shows_what_it_is(self):
        assert repr(loop(10.0)) == "BSplineCurve(closed, 2D, 83 control points, length 62.83)"
        assert repr(line((0, 0, 0), (0, 0, 2))) == "BSplineCurve(open, 3D, 12 control points, length 2)"


class TestBeyondTheEnds:
    @pytest.mark.parametrize("u", [1.5, -0.1, [0.5, 1.0 + 1e-6], np.nan, np.inf])
    @pytest.mark.parametrize("derivative", [0, 1])
    def test_an_open_curve_is_not_led_on_unless_asked(self, u, derivative):
        with pytest.raises(
            InputError, match=r"u must be within 0\.\.1 on an open curve, got .*extrapolate=True goes on"
        ):
            wave()(u, derivative)

    def test_led_on_it_is_straight_and_as_long(self):
        curve = wave()
        before, after = curve.start - 0.2 * curve(0.0, 1), curve.end + 0.5 * curve(1.0, 1)
        np.testing.assert_allclose(curve([-0.2, 0.5, 1.5], extrapolate=True), [before, curve(0.5), after], rtol=1e-12)
        np.testing.assert_array_equal(curve([1.5, 1.0], 1, extrapolate=True)[0], curve(1.0, 1))
        np.testing.assert_array_equal(curve([1.5, 0.5], 2, extrapolate=True), [[0.0, 0.0], curve(0.5, 2)])

    def test_rounding_is_forgiven(self):
        np.testing.assert_allclose(wave()([-1e-10, 1.0 + 1e-10]), wave()([0.0, 1.0]), atol=1e-6)

    def test_tangent_and_curvature_end_where_the_curve_does(self):
        for of in (wave().tangent, wave().curvature):
            with pytest.raises(InputError, match="u must be within"):
                of(2.0)

    def test_a_loop_goes_on_around(self):
        np.testing.assert_allclose(loop(10.0)([1.25, -0.5]), loop(10.0)([0.25, 0.5]), atol=1e-9)

    def test_the_ends_have_names(self):
        np.testing.assert_array_equal(np.stack((wave().start, wave().end)), wave()([0.0, 1.0]))
        np.testing.assert_allclose(loop(10.0).start, loop(10.0).end, atol=1e-9)


class TestNearest:
    @given(curves, st.integers(0, 10_000))
    def test_no_point_of_the_curve_is_nearer(self, curve, seed):
        rng = np.random.default_rng(seed)
        low, high = curve.control_points.min(axis=0), curve.control_points.max(axis=0)
        place = rng.uniform(low - 0.3 * (high - low), high + 0.3 * (high - low))
        u, distance = curve.nearest(place)
        assert 0.0 <= u <= 1.0
        assert distance == pytest.approx(np.linalg.norm(curve(u) - place))
        dense = np.linalg.norm(curve.sample(3000) - place, axis=1)
        assert distance <= dense.min() + 1e-9

    @given(curves, st.floats(0.0, 1.0))
    def test_a_point_of_the_curve_is_its_own_nearest(self, curve, u):
        found, distance = curve.nearest(curve(u))
        assert distance < 1e-6 * np.ptp(curve.control_points)
        np.testing.assert_allclose(curve(found), curve(u), atol=1e-6 * np.ptp(curve.control_points))

    def test_beside_a_straight_line_it_is_the_foot_and_beyond_it_the_end(self):
        straight = line((0, 0), (10, 0))
        assert straight.nearest((2.5, 3.0)) == pytest.approx((0.25, 3.0))
        assert straight.nearest((-4.0, 3.0)) == pytest.approx((0.0, 5.0))
        assert straight.nearest((13.0, 4.0)) == pytest.approx((1.0, 5.0))

    def test_it_is_exact_between_samples(self):
        circle = loop(10.0)
        for angle in np.linspace(0.0, 6.0, 17):
            _, distance = circle.nearest(13.0 * np.array([np.cos(angle), np.sin(angle)]))
            assert distance == pytest.approx(3.0, abs=1e-3)

    @pytest.mark.parametrize("point", [(1.0, 2.0, 3.0), 5.0, "x", (np.nan, 0.0)])
    def test_what_is_no_point_is_refused(self, point):
        with pytest.raises(InputError, match="point"):
            wave().nearest(point)


SHARPEST = [
    pytest.param(BSplineCurve([0, 0, 0, 0, 1, 1, 1, 1], [(0, 0), (1, 1), (0, 1), (1, 0)]), id="a cusp"),
    pytest.param(BSplineCurve([0, 0, 0, 0, 1, 1, 1, 1], [(0, 0), (2, 0), (-1, 0), (1, 0)]), id="back and forth"),
    pytest.param(BSplineCurve([0, 0, 0, 1, 1, 1], [(0, 0), (1e-6, 1), (0, 0)], 2), id="there and back"),
    pytest.param(BSplineCurve([0, 0, 1, 2, 3, 3] / np.array(3.0), [(0, 0), (9, 0), (0, 1), (1, 1)], 1), id="corners"),
    pytest.param(BSplineCurve(KNOTS, [(0, 0), (0, 0), (0, 0), (0, 0), (5, 5)]), id="it stands still"),
    pytest.param(curve_through(np.array([(40 * k, 200 * (k % 2)) for k in range(12)])), id="zigzag"),
    pytest.param(curve_through(np.array([(k, k % 2, k % 3) for k in range(12)]) * 0.1), id="zigzag in space"),
    pytest.param(bent((0, 0), (300, 0), (20, 9), (320, 30)), id="hairpins"),
    pytest.param(
        BSplineCurve(
            [0, 0, 0, 0, 0.25, 0.34, 1, 1, 1, 1], [(104, 42), (114, 44), (113, 61), (150, 72), (153, 18), (126, 22)]
        ),
        id="a long span whose speeds are alike at the nodes",
    ),
]


def polyline(curve: BSplineCurve) -> tuple[np.ndarray, np.ndarray]:
    """Return dense parameters of the spline, and the share of the length at each; its slow twin."""
    breaks = np.unique(curve.knots.clip(0.0, 1.0))
    t = np.unique(np.concatenate([np.linspace(a, b, 3001) for a, b in itertools.pairwise(breaks)]))
    along = np.concatenate(([0.0], np.cumsum(np.linalg.norm(np.diff(curve.spline(t), axis=0), axis=1))))
    return t, along


def check_lengths(curve: BSplineCurve) -> None:
    t, along = polyline(curve)
    assert curve.length == pytest.approx(along[-1], rel=5e-5)
    assert np.abs(curve.u_at(t) - along / along[-1]).max() < 5e-5
    at = np.interp(curve.t_at(U), t, along / along[-1])
    assert np.abs(at - U).max() < 1e-4
    assert (np.diff(curve.t_at(np.linspace(0.0, 1.0, 1001))) >= 0.0).all()


class TestLength:
    """``u`` is the share of the length, to 1e-4, however sharply a curve bends."""

    @given(curves)
    def test_both_are_those_of_a_fine_polyline(self, curve):
        check_lengths(curve)

    @pytest.mark.parametrize("curve", SHARPEST)
    def test_the_sharpest_bends(self, curve):
        check_lengths(curve)

    def test_a_single_u_where_the_curve_comes_to_a_halt(self):
        curve = BSplineCurve([0, 0, 0, 0, 1, 1, 1, 1], [(0, 0), (1, 0), (1, 0), (1, 0)])
        for u in (1.0, 0.9999999):
            np.testing.assert_array_equal(curve(u), curve([u])[0])
            np.testing.assert_array_equal(curve.tangent(u), curve.tangent([u])[0])

    @pytest.mark.parametrize("seed", range(40))
    def test_hairpins_in_every_span(self, seed):
        """Control points at random over evenly spaced knots; five nodes a span were off by 3 % of the length."""
        rng = np.random.default_rng(seed)
        spans, ndim = int(rng.integers(2, 40)), int(rng.integers(2, 4))
        knots = np.concatenate((np.zeros(3), np.linspace(0.0, 1.0, spans + 1), np.ones(3)))
        check_lengths(BSplineCurve(knots, rng.uniform(0.0, 100.0, (spans + 3, ndim))))

    @given(curves, st.integers(2, 60))
    def test_samples_are_equally_spaced(self, curve, n):
        for points in (curve.sample(n), curve.resample(n), curve.sample(spacing=curve.length / (n - 1))):
            assert len(points) == n
            np.testing.assert_allclose(points, curve(np.linspace(0.0, 1.0, n)), rtol=0, atol=1e-6 * curve.length)

    def test_spacing_is_in_the_unit_of_the_curve(self):
        steps = np.diff(line((0, 0, 0), (0, 0, 0.5)).sample(spacing=0.01)[:, 2])
        np.testing.assert_allclose(steps, np.full(50, 0.01), rtol=1e-9)
        steps = np.diff(line((0, 0), (10, 0)).sample(spacing=3.0)[:, 0])
        np.testing.assert_allclose(steps, np.full(4, 2.5), rtol=1e-9)  # it divides the length
        np.testing.assert_array_equal(line((0, 0), (1, 0)).sample(spacing=9.0), line((0, 0), (1, 0)).sample(2))
        assert len(BSplineCurve(KNOTS, np.zeros((5, 2))).sample(spacing=1.0)) == 2

    @pytest.mark.parametrize("spacing", [0.0, -1.0, 1e-12, np.nan, np.inf, "1", True])
    def test_a_spacing_of_nothing_is_refused(self, spacing):
        with pytest.raises(InputError, match="spacing must be a finite number in"):
            wave().sample(spacing=spacing)

    @pytest.mark.parametrize("given", [{}, {"n": 5, "spacing": 1.0}])
    def test_a_number_or_a_spacing(self, given):
        with pytest.raises(InputError, match="give either n or spacing, got n="):
            wave().sample(**given)

    @given(curves)
    def test_one_parameter_leads_to_the_other_and_back(self, curve):
        np.testing.assert_allclose(curve.u_at(curve.t_at(U)), U, rtol=0, atol=1e-9)
        assert curve.t_at([0.0, 1.0]).tolist() == curve.u_at([0.0, 1.0]).tolist() == [0.0, 1.0]
        assert curve.t_at(0.5).shape == ()
        assert curve.u_at(U.reshape(1, 41, 1)).shape == (1, 41, 1)

    def test_around_a_loop_both_go_on(self):
        circle = random_curve(3, closed=True)
        np.testing.assert_allclose(circle.t_at(U + 2.0), circle.t_at(U) + 2.0, atol=1e-9)
        np.testing.assert_allclose(circle.u_at(U - 1.0), circle.u_at(U) - 1.0, atol=1e-9)

    @pytest.mark.parametrize("value", [1.1, -0.1, np.nan, "x"])
    def test_neither_leaves_an_open_curve(self, value):
        for convert, name in ((wave().t_at, "u"), (wave().u_at, "t")):
            with pytest.raises(InputError, match=f"^{name} must be"):
                convert(value)
        for convert in (loop(10.0).t_at, loop(10.0).u_at):
            np.testing.assert_array_equal(convert([0.25]).shape, (1,))

    @pytest.mark.parametrize("place", [1.0, 0.1, 1e9 + 0.1])
    def test_rounding_is_no_length_to_be_measured(self, place):
        """The derivatives of a point are rounding, and differ without end."""
        still = BSplineCurve(KNOTS, np.full((5, 2), place))
        assert still.length < 1e-12 * place
        assert len(still._along.starts) < 10
        np.testing.assert_allclose(still(U), np.full((41, 2), place))

    def test_a_curve_of_no_length_keeps_its_parameter(self):
        still = BSplineCurve(KNOTS, np.zeros((5, 2)))
        np.testing.assert_array_equal(still.t_at(U), U)
        np.testing.assert_array_equal(still.u_at(U), U)
        np.testing.assert_array_equal(still(U), np.zeros((41, 2)))
