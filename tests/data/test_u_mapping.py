"""The same place on a curve in the image and on the one in space."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from builders import curve_through, detection_of, line
from hypothesis import given
from hypothesis import strategies as st

from dloftbs import BSplineCurve, InputError, PinholeCamera, Track, TrackState
from dloftbs.data.u_mapping import to_image, to_space

CAMERA = PinholeCamera(500.0, 510.0, 320.0, 240.0, distortion=(0.05, -0.02, 0.001, 0.0))
COORDINATES = st.tuples(st.floats(-0.3, 0.3), st.floats(-0.2, 0.2), st.floats(0.4, 2.0))


def seen(deep: BSplineCurve) -> BSplineCurve:
    """Return the curve as the camera sees it."""
    return curve_through(CAMERA.project(deep.sample(400)))


@given(st.lists(COORDINATES, min_size=4, max_size=6), st.lists(st.floats(0.0, 1.0), min_size=1, max_size=5))
def test_the_mapping_is_undone_by_the_one_back_and_keeps_the_order(points, u):
    deep = BSplineCurve(
        np.concatenate([np.zeros(4), np.linspace(0, 1, len(points) - 2)[1:-1], np.ones(4)]), np.array(points)
    )
    there = to_space(sorted(u), deep, CAMERA)
    assert (np.diff(there) >= 0.0).all()
    # Only where the curve does not stand still in the image, as one that is seen from its end does.
    moves = np.linalg.norm(np.diff(CAMERA.project(deep.sample(1000)), axis=0), axis=1)
    if moves.min() > 1e-6 * moves.sum():
        assert to_image(there, deep, CAMERA) == pytest.approx(sorted(u), abs=1e-9)
    assert to_space([0.0, 1.0], deep, CAMERA).tolist() == [0.0, 1.0]


def test_a_place_in_the_image_is_the_place_in_space():
    deep = curve_through(np.array([(-0.2, 0.0, 0.5), (0.0, 0.1, 0.8), (0.2, 0.0, 1.2), (0.3, -0.1, 1.6)]))
    found = replace(detection_of(seen(deep), deep), camera=CAMERA)
    u = np.linspace(0.0, 1.0, 21)
    there = found.u_3d(u)
    assert np.abs(CAMERA.project(deep(there)) - found.curve(u)).max() < 0.05
    assert there[10] < 0.45  # the nearer half takes up more of the image
    assert found.u_2d(there) == pytest.approx(u, abs=1e-9)
    assert found.reversed().u_3d(1.0 - u) == pytest.approx(1.0 - there, abs=1e-5)
    assert np.ndim(found.u_3d(0.5)) == 0
    track = Track(1, TrackState.CONFIRMED, found.curve, deep, 1, 0, found, camera=CAMERA)
    assert track.u_3d(u).tolist() == there.tolist()
    assert track.u_2d(there).tolist() == found.u_2d(there).tolist()


def test_a_cable_seen_from_its_end_is_mapped_evenly():
    end_on = line((0.0, 0.0, 1.0), (0.0, 0.0, 2.0))
    plain = PinholeCamera(500.0, 500.0, 320.0, 240.0)
    assert to_space(0.25, end_on, plain) == pytest.approx(0.25)


def test_without_metres_the_reason_is_said():
    found = replace(detection_of(line((0, 0), (9, 0))), no_3d_reason="the frame has no depth")
    for ask in (found.u_3d, found.u_2d):
        with pytest.raises(InputError, match="no curve in space: the frame has no depth"):
            ask(0.5)
    with pytest.raises(InputError, match="the camera of the curve in space must be known"):
        detection_of(line((0, 0), (9, 0)), line((0, 0, 1), (1, 0, 1))).u_3d(0.5)
    with pytest.raises(InputError, match=r"there is no curve in space$"):
        Track(1, TrackState.CONFIRMED, line((0, 0), (9, 0)), None, 1, 0, None).u_3d(0.5)


@pytest.mark.parametrize("u", [-0.1, 1.1, np.nan, "half", None, [0.0, 2.0]])
def test_what_is_no_place_is_refused(u):
    deep = line((0, 0, 1), (1, 0, 1))
    for mapping in (to_space, to_image):
        with pytest.raises(InputError, match=r"u(_3d)? must"):
            mapping(u, deep, CAMERA)


def test_a_curve_behind_the_camera_has_no_image():
    with pytest.raises(InputError, match="must lie in front of the camera"):
        to_space(0.5, line((0, 0, -1), (1, 0, 1)), CAMERA)
