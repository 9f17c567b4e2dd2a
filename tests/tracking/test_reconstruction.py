"""Whole curves from the parts that are seen and the shape that is remembered."""

from __future__ import annotations

import numpy as np
import pytest
from builders import curve_through, line, part, wave

from dloftbs.tracking.reconstruction import EVEN_U, VisiblePart, reconstruct

U = np.linspace(0.0, 1.0, 101)
WHOLE = (0.0, 1.0)


def turned(curve, angle: float, shift: tuple[float, float] = (0.0, 0.0)):
    c, s = np.cos(angle), np.sin(angle)
    return curve.transformed([[c, -s], [s, c]], shift)


@pytest.mark.parametrize("angle", [0.0, 0.5, -2.0, 3.1])
@pytest.mark.parametrize(
    "seen", [[(0.0, 0.6)], [(0.4, 1.0)], [(0.2, 0.7)], [(0.0, 0.3), (0.7, 1.0)], [(0.1, 0.3), (0.6, 0.8)]]
)
def test_what_is_carried_and_turned_is_known_as_a_whole(seen, angle):
    true = turned(wave(), angle, (70.0, -20.0))
    curve = reconstruct(wave()(EVEN_U), [VisiblePart(part(true, *span), span, WHOLE) for span in seen], true.length)
    np.testing.assert_allclose(curve(U), true(U), atol=0.5)


def test_a_stretch_of_a_detection_is_taken_from_it():
    curve = reconstruct(wave()(EVEN_U), [VisiblePart(wave((5.0, 0.0)), (0.2, 0.8), (0.2, 0.8))], wave().length)
    np.testing.assert_allclose(curve(U), wave((5.0, 0.0))(U), atol=0.5)


def test_a_hidden_bend_keeps_its_length_while_the_ends_come_nearer():
    before = line((0.0, 0.0), (500.0, 0.0))
    left, right = line((0.0, 0.0), (150.0, 0.0)), line((310.0, 0.0), (460.0, 0.0))
    bump = curve_through(before(U) + np.stack((0.0 * U, 30.0 * np.sin(np.pi * U)), axis=1))
    parts = [VisiblePart(left, (0.0, 0.3), WHOLE), VisiblePart(right, (0.7, 1.0), WHOLE)]
    curve = reconstruct(bump(EVEN_U), parts, bump.length)
    hidden = curve(np.linspace(0.3, 0.7, 101))
    assert np.linalg.norm(np.diff(hidden, axis=0), axis=1).sum() == pytest.approx(0.4 * bump.length, rel=0.02)
    np.testing.assert_allclose(curve([0.3, 0.7]), [[150.0, 0.0], [310.0, 0.0]], atol=2.0)


def test_in_space():
    c, s = np.cos(0.4), np.sin(0.4)
    before = curve_through(np.stack((U, 0.1 * np.sin(6.0 * U), 1.0 + 0.1 * U), axis=1))
    true = before.transformed([[c, 0.0, -s], [0.0, 1.0, 0.0], [s, 0.0, c]], [0.1, 0.0, 0.0])
    spans = [(0.0, 0.4), (0.6, 1.0)]
    curve = reconstruct(before(EVEN_U), [VisiblePart(part(true, *span), span, WHOLE) for span in spans], true.length)
    np.testing.assert_allclose(curve(U), true(U), atol=0.002)


def test_what_falls_between_all_places_leaves_all_as_it_was():
    curve = reconstruct(wave()(EVEN_U), [VisiblePart(wave((5.0, 0.0)), (0.5001, 0.5002), WHOLE)], 1.0)
    np.testing.assert_allclose(curve(U), wave()(U), atol=0.01)
