"""Objects through time: their checks and plain values."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from builders import NOT_SPANS, detection_of, line, loop, through_json, wave

from dloftbs.camera import PinholeCamera
from dloftbs.data.curve import BSplineCurve
from dloftbs.data.tracks import EndKind, SeenPart, Track, TrackState
from dloftbs.errors import InputError
from dloftbs.support.values import varied


class TestTrack:
    def test_the_dictionary_is_strict_json(self):
        curve_3d = line((0.0, 0.0, 1.0), (1.0, 0.0, 2.0))
        data = through_json(Track(3, TrackState.HIDDEN, loop(20.0), curve_3d, 5, 2, None).to_dict())
        assert (data["id"], data["state"], data["hits"], data["misses"]) == (3, "hidden", 5, 2)
        assert BSplineCurve.from_dict(data["curve"]) == loop(20.0)
        assert BSplineCurve.from_dict(data["curve_3d"]) == curve_3d

    @pytest.mark.parametrize(
        ("name", "value"),
        [
            *(("id", value) for value in (0, -1, 1.0, True, "1", 10**400)),
            *(("state", value) for value in ("confirmed", None)),
            *(("curve", value) for value in (None, line((0, 0, 0), (1, 1, 1)))),
            *(("curve_3d", value) for value in ("x", wave())),
            *(("hits", value) for value in (-1, 1.0)),
            *(("misses", value) for value in (-1, None)),
            ("detection", wave()),
            *(("confidence", value) for value in (-0.1, 1.1, math.nan, None)),
            *(("width_px", value) for value in (-0.1, math.inf, math.nan, "3")),
        ],
    )
    def test_wrong_fields_are_refused(self, name, value):
        with pytest.raises(InputError, match=f"{name} must be"):
            replace(Track(1, TrackState.CONFIRMED, wave(), None, 1, 0, None), **{name: value})

    @pytest.mark.parametrize("spans", NOT_SPANS)
    def test_what_is_inferred_lies_within_the_curve(self, spans):
        with pytest.raises(InputError, match="inferred must be"):
            Track(1, TrackState.CONFIRMED, wave(), None, 1, 0, None, spans)


def in_motion() -> Track:
    """Return a track in space with all that a track may have."""
    curve, curve_3d = wave(), line((0.0, 0.0, 1.0), (1.0, 0.0, 2.0))
    return Track(
        1, TrackState.CONFIRMED, curve, curve_3d, 5, 0, detection_of(curve, curve_3d), ((0.0, 0.25), (0.5, 0.625)), 0.5,
        6.0, (EndKind.HIDDEN, EndKind.FREE), np.arange(6.0).reshape(3, 2), np.arange(9.0).reshape(3, 3),
    )  # fmt: skip


def test_another_curve_in_space_has_no_velocity() -> None:
    track, other = in_motion(), line((0.0, 0.0, 3.0), (1.0, 0.0, 4.0))
    replaced = track._with_detection(detection_of(track.curve, other))
    assert (replaced.detection.curve_3d, replaced.curve_3d, replaced.velocity_3d) == (other, other, None)
    assert replaced.velocity.tolist() == track.velocity.tolist()
    gone = track._with_detection(detection_of(track.curve))
    assert (gone.curve_3d, gone.velocity_3d) == (None, None)


def test_of_a_curve_in_space_that_is_what_is_seen_nothing_else_is_inferred() -> None:
    """As a rig gives it: a view completes its track, and has in space what both views show."""
    seen = replace(
        detection_of(line((0.0, 0.0), (50.0, 0.0)), line((0.0, 0.0, 1.0), (1.0, 0.0, 1.0))), inferred_3d=((0.1, 0.2),)
    )
    whole = line((0.0, 0.0), (100.0, 0.0))
    track = Track(1, TrackState.CONFIRMED, whole, seen.curve_3d, 1, 0, seen, ((0.5, 1.0),))
    assert track.inferred_3d == ((0.1, 0.2),)


def test_run_the_other_way_all_that_lies_along_it_is_mirrored() -> None:
    track = in_motion()
    turned = track.reversed()
    assert (turned.curve, turned.curve_3d) == (track.curve.reversed(), track.curve_3d.reversed())
    assert turned.detection.curve == turned.curve
    assert turned.inferred == ((0.375, 0.5), (0.75, 1.0))
    assert turned.ends == (EndKind.FREE, EndKind.HIDDEN)
    assert turned.velocity.tolist() == track.velocity[::-1].tolist()
    assert turned.velocity_3d.tolist() == track.velocity_3d[::-1].tolist()


def test_run_the_other_way_depth_is_missing_at_the_same_places() -> None:
    """Two detections show the track, the longer one with depth and the other without any."""
    camera = PinholeCamera(100.0, 100.0, 0.0, 0.0)
    whole, whole_3d = line((0.0, 0.0), (100.0, 0.0)), line((0.0, 0.0, 1.0), (1.0, 0.0, 1.0))
    long = detection_of(line((0.0, 0.0), (50.0, 0.0)), line((0.0, 0.0, 1.0), (0.5, 0.0, 1.0)))
    long = replace(long, inferred_3d=((0.25, 0.5),), camera=camera)
    short = detection_of(line((75.0, 0.0), (100.0, 0.0)))
    track = varied(
        Track(1, TrackState.CONFIRMED, whole, whole_3d, 3, 0, long, ((0.55, 0.7),), camera=camera),
        _fitted_parts=(SeenPart(long, (0.0, 0.5), (0.0, 1.0)), SeenPart(short, (0.75, 1.0), (0.0, 1.0))),
    )
    turned, u = track.reversed(), np.linspace(0.0, 1.0, 21)
    mirrored = [(1.0 - high, 1.0 - low) for low, high in reversed(track.inferred_3d)]
    assert len(mirrored) == 3
    np.testing.assert_allclose(turned.inferred_3d, mirrored, atol=1e-9)
    np.testing.assert_allclose(turned.curve_3d_std(1.0 - u), track.curve_3d_std(u), rtol=1e-6)


def test_a_hidden_part_of_a_loop_is_as_unsure_whatever_turn_its_u_is_of() -> None:
    seen, curve = detection_of(loop(50.0)), loop(50.5)
    track = Track(1, TrackState.CONFIRMED, curve, None, 1, 0, seen, ((0.0, 0.25), (0.75, 1.0)))
    assert track.curve_std([1.1, -0.1]) == pytest.approx(track.curve_std([0.1, 0.9]))
    assert track.curve_std(1.1) > 2.0 * track.curve_std(0.5)
