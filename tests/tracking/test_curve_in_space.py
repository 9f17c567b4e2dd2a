"""Parts of tracks in space."""

from __future__ import annotations

import numpy as np
import pytest

from dloftbs import BSplineCurve, PinholeCamera
from dloftbs.evidence import OcclusionEvidence
from dloftbs.tracking.curve_in_space import span_in_space
from dloftbs.tracking.frame_view import View
from dloftbs.tracking.reconstruction import EVEN_U, fit_samples

CAMERA = PinholeCamera(600.0, 600.0, 320.0, 240.0)
SIZE = (480, 640)


def curve_at(depths_m: np.ndarray) -> BSplineCurve:
    """Return the curve in space, by its length, of a straight cable from column 20 to 620, at these distances."""
    columns = np.linspace(20.0, 620.0, len(depths_m))
    points = np.stack(((columns - CAMERA.cx) / CAMERA.fx * depths_m, np.zeros(len(depths_m)), depths_m), axis=1)
    along = np.concatenate(([0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))))
    evenly = [np.interp(EVEN_U * along[-1], along, column) for column in points.T]
    return fit_samples(np.stack(evenly, axis=1))


def seen_columns(curve: BSplineCurve, span: tuple[float, float]) -> list[float]:
    """Return the columns in which a camera sees both ends of a span."""
    points = curve(np.array(span))
    return (CAMERA.fx * points[:, 0] / points[:, 2] + CAMERA.cx).tolist()


@pytest.mark.parametrize("span", [(0.0, 0.3), (0.25, 0.6), (0.7, 1.0), (0.0, 1.0)])
@pytest.mark.parametrize(
    "depths_m",
    [
        np.interp(np.linspace(0.0, 1.0, 121), [0.47, 0.53], [0.6, 0.9]),  # it goes over to another cable
        np.linspace(0.4, 1.2, 121),  # it is tilted
    ],
)
def test_a_span_in_space_is_seen_where_the_one_in_the_image_is(depths_m, span):
    view = View(SIZE, OcclusionEvidence(depth=np.ones(SIZE, np.float32), camera=CAMERA))
    curve = curve_at(depths_m)
    expected = [20.0 + 600.0 * u for u in span]
    np.testing.assert_allclose(seen_columns(curve, span_in_space(curve, span, view)), expected, atol=3.0)
    if span != (0.0, 1.0):
        assert np.abs(np.subtract(seen_columns(curve, span), expected)).max() > 15.0  # the same span is seen elsewhere


def test_without_a_camera_a_span_stays_the_same():
    assert span_in_space(curve_at(np.full(121, 0.8)), (0.2, 0.7), View(SIZE)) == (0.2, 0.7)
