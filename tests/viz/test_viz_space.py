"""Curves in space on a sheet."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from builders import curve_through, detection_of, line

from dloftbs import viz
from dloftbs.camera import PinholeCamera
from dloftbs.data.frame import Frame
from dloftbs.data.frame_result import FrameResult
from dloftbs.data.tracks import Track, TrackState
from dloftbs.errors import InputError
from dloftbs.viz import space_sheet
from dloftbs.viz.style import Style

SIZE = (90, 160)
PANEL = Style().panel_px
CAMERA = PinholeCamera(150.0, 150.0, 80.0, 45.0)


def detection(curve_3d=None, reason=None, inferred=()):
    found = detection_of(line((20.0, 40.0), (140.0, 50.0)), curve_3d)
    return replace(found, no_3d_reason=reason, inferred_3d=inferred)


def result(*detections, tracks=()):
    return FrameResult(detections, tracks, None, SIZE)


def frame(depth=None):
    return Frame(image=np.full((*SIZE, 3), 90, np.uint8), depth=depth, camera=CAMERA)


def panels(sheet):
    """The four pictures of a sheet, row by row; every one is as wide as the style says."""
    gutter = (sheet.shape[1] - 2 * PANEL) // 3
    height = round(PANEL * SIZE[0] / SIZE[1])
    bar = (sheet.shape[0] - 2 * height - 3 * gutter) // 2
    tops = [gutter + bar, 2 * (gutter + bar) + height]
    return [sheet[t : t + height, x : x + PANEL] for t in tops for x in (gutter, 2 * gutter + PANEL)]


def of_colour(picture, order):
    return np.argwhere((picture == Style().colour(order)).all(axis=2))[:, ::-1]


def test_both_sides_have_one_scale_and_the_axes_point_the_right_way():
    # 0.3 m to the right, 0.1 m up, 0.2 m away.
    curve = line((0.0, 0.1, 0.8), (0.3, 0.0, 1.0))
    _, _, above, side = panels(viz.draw_3d(frame(), result(detection(curve))))
    extents = [np.ptp(of_colour(picture, 0), axis=0) for picture in (above, side)]
    assert extents[0][0] / 0.3 == pytest.approx(extents[0][1] / 0.2, rel=0.1)
    assert extents[1][0] / 0.2 == pytest.approx(extents[1][1] / 0.1, rel=0.2)
    assert extents[0][0] / 0.3 == pytest.approx(extents[1][0] / 0.2, rel=0.1)
    for picture in (above, side):  # away is up in the one and right in the other, and y grows downwards
        x, y = of_colour(picture, 0).T
        assert np.corrcoef(x, y)[0, 1] < -0.9


def test_what_was_inferred_is_dashed():
    curve = line((0.0, 0.0, 0.8), (0.4, 0.0, 0.8))
    whole, dashed = (
        np.unique(of_colour(panels(viz.draw_3d(frame(), result(detection(curve, inferred=spans))))[2], 0)[:, 0])
        for spans in ((), ((0.4, 0.6),))
    )
    gaps = np.setdiff1d(whole, dashed)
    assert len(gaps) > 20
    middle = whole.min() + np.array([0.4, 0.6]) * np.ptp(whole)
    assert gaps.min() > middle[0] - 10
    assert gaps.max() < middle[1] + 10


def test_tracks_have_the_colours_of_their_ids_and_hidden_ones_are_dimmer():
    curves = [line((0.0, 0.0, z), (0.4, 0.1, z)) for z in (0.8, 1.0)]
    seen = detection(curves[0])
    tracks = (
        Track(3, TrackState.CONFIRMED, seen.curve, curves[0], 1, 0, seen),
        Track(5, TrackState.HIDDEN, seen.curve, curves[1], 1, 4, None),
    )
    above = panels(viz.draw_3d(frame(), result(seen, tracks=tracks)))[2]
    assert len(of_colour(above, 2)) > 200
    assert len(of_colour(above, 0)) == len(of_colour(above, 4)) == 0


def test_missing_depth_is_hatched_and_the_share_is_told():
    depth = np.tile(np.linspace(0.5, 1.5, SIZE[1], dtype=np.float32), (SIZE[0], 1))
    depth[:45, :80] = (0.0, np.nan, np.inf, -1.0) * 20
    size = (PANEL, PANEL // 2)
    title, panel = space_sheet._depth_panel(frame(depth), size, Style())
    assert title.endswith("missing, 25.0 %")
    height, width = panel.shape[:2]
    red = (panel == Style().changed).all(axis=2)
    assert 0.4 < red[: height // 2 - 5, : width // 2 - 5].mean() < 0.6
    assert not red[:, width // 2 + 5 :].any()
    title, _ = space_sheet._depth_panel(
        frame((np.nan_to_num(depth, posinf=0.0).clip(0) * 1000).astype(np.uint16)), size, Style()
    )
    assert title.startswith("depth, 0.5")


@pytest.mark.parametrize("depth", [None, np.zeros(SIZE, np.uint16)])
def test_without_depth_or_curves_there_is_a_sheet_that_says_so(depth):
    bare = viz.draw_3d(frame(depth), result(detection(None)))
    told = viz.draw_3d(frame(depth), result(detection(None, "only 3 points of it have depth")))
    assert bare.shape == told.shape
    assert (bare != told).any()


@pytest.mark.parametrize("size", [(4000, 40), (40, 4000), (4, 4000), (4000, 4)])
def test_a_crop_along_a_cable_has_a_sheet_of_a_handy_size(size):
    strip = Frame(mask=np.zeros(size, np.uint8), depth=np.ones(size, np.float32))
    sheet = viz.draw_3d(strip, FrameResult((), (), None, size))
    assert max(sheet.shape) < 2.2 * PANEL


def test_a_point_and_a_far_away_loop_can_be_drawn():
    angle = 2 * np.pi * np.arange(40) / 40
    loop = curve_through(np.column_stack((np.cos(angle), np.sin(angle), np.full(40, 300.0))), closed=True)
    dot = curve_through(np.linspace((0.0, 0.0, 1.0), (1e-6, 0.0, 1.0), 12))
    for curve in (loop, dot):
        assert len(of_colour(panels(viz.draw_3d(frame(), result(detection(curve))))[2], 0)) > 10


@pytest.mark.parametrize("wanted", [0.011, 0.02, 0.3, 1.0, 7.0])
def test_steps_are_round(wanted):
    step = space_sheet._round_step(wanted)
    assert wanted <= step * (1 + 1e-9) <= 2.5 * wanted * (1 + 1e-6)
    assert f"{step:e}"[0] in "125"


def test_what_is_no_frame_is_refused():
    with pytest.raises(InputError, match="frame must be a Frame, got array"):
        viz.draw_3d(np.zeros(SIZE), result())
