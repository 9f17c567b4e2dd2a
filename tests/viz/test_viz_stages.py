"""The sheet of one frame's stages."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from dloftbs import viz
from dloftbs.data.centerline import JointKind, Segment
from dloftbs.data.frame import Frame
from dloftbs.data.stage_trace import StageTrace
from dloftbs.data.tracks import TrackState
from dloftbs.errors import InputError
from dloftbs.viz.view import View

STYLE = viz.Style()


def has(picture, colour, tolerance=3):
    return int((np.abs(picture.astype(int) - colour) <= tolerance).all(axis=2).sum())


def halves(sheet):
    """Cut the sheet into its panels, 1 to 6; gutters and titles may be off by some pixels."""
    height, width = sheet.shape[:2]
    return [
        sheet[r * height // 2 : (r + 1) * height // 2, c * width // 3 : (c + 1) * width // 3]
        for r in range(2)
        for c in range(3)
    ]


@pytest.fixture
def trace_of(build):
    def make(size=(120, 160), image=None, found=True, hidden=False):
        mask = np.zeros(size, bool)
        if not found:
            empty = np.empty((0, 2))
            result = build.result(size, reason="the mask is empty")
            return StageTrace(Frame(image=image, mask=mask), mask, mask, empty, empty, empty, (), (), result)
        mask[57:64, 20:141] = True
        mask[57:64, 70:91] = False
        cleaned = mask.copy()
        mask[55, 30] = True
        points = build.straight((20, 60), (140, 60))
        detection = build.detection(points, ((JointKind.GAP, (0.42, 0.58)),), 7.0)
        state = TrackState.HIDDEN if hidden else TrackState.CONFIRMED
        result = build.result(size, (detection,), (build.track(2, detection, state),))
        skeleton = np.rint(np.vstack([s.points for s in detection.centerline.segments]))
        ends = np.array([s.points[i] for s in detection.centerline.segments for i in (0, -1)])
        short = Segment(np.array([[30.0, 59.0], [30.0, 58.0]]), [1.0, 1.0])
        return StageTrace(
            Frame(image=image, mask=mask),
            mask,
            cleaned,
            skeleton,
            ends,
            np.array([[30.0, 60.0]]),
            detection.centerline.segments,
            (short,),
            result,
        )

    return make


def test_six_panels_of_one_size(trace_of):
    sheet = viz.draw_stages(trace_of())
    assert sheet.dtype == np.uint8
    assert sheet.shape[2] == 3
    # 160 x 120 px are shown five times as large, in three columns and two rows.
    assert 3 * 5 * 100 < sheet.shape[1] < 3 * 5 * 160 + 100
    assert 1.0 < sheet.shape[1] / sheet.shape[0] < 3.0


def test_each_panel_shows_its_stage(trace_of):
    mask, cleaned, skeleton, segments, linked, curves = halves(viz.draw_stages(trace_of()))
    assert has(mask, STYLE.mask) > 1000
    assert has(mask, STYLE.changed) == 0
    assert has(cleaned, STYLE.changed) > 10
    assert has(skeleton, STYLE.colour(1), 40) > 10  # branch points
    assert has(skeleton, STYLE.colour(0), 40) > 10  # endpoints
    assert has(segments, STYLE.colour(0)) > 50
    assert has(segments, STYLE.colour(1)) > 50
    assert has(segments, STYLE.mask) > 10  # too short
    assert has(linked, STYLE.colour(1), 40) > 50  # the colour of track 2
    assert has(curves, STYLE.colour(1), 40) > 50


def test_without_tracks_colours_go_by_order_and_crossings_are_marked(build):
    size = (120, 160)
    mask = np.zeros(size, bool)
    mask[57:64, 20:141] = True
    detection = build.detection(build.straight((20, 60), (140, 60)), ((JointKind.CROSSING, (0.48, 0.52)),), 7.0)
    empty = np.empty((0, 2))
    trace = StageTrace(Frame(mask=mask), mask, mask, empty, empty, empty, (), (), build.result(size, (detection,)))
    *_, linked, curves = halves(viz.draw_stages(trace))
    assert has(linked, STYLE.colour(0), 40) > 50
    assert has(curves, STYLE.colour(0), 40) > 50
    rows = np.flatnonzero((np.abs(linked.astype(int) - STYLE.colour(0)) <= 40).all(axis=2).any(axis=1))
    assert np.ptp(rows) > 8  # a straight line alone would be flat


def test_wrong_traces_are_refused(build):
    with pytest.raises(InputError, match=r"StageTrace, got FrameResult\("):
        viz.draw_stages(build.result((10, 10)))


def test_a_hidden_track_is_not_linked(trace_of):
    *_, linked, curves = halves(viz.draw_stages(trace_of(hidden=True)))
    assert has(linked, STYLE.colour(1), 40) == 0
    assert has(curves, STYLE.colour(1), 90) > 50


def test_the_reason_is_on_the_sheet(trace_of):
    panels = halves(viz.draw_stages(trace_of(found=False)))
    corner = [panel[-40:, :200] for panel in panels]
    assert has(corner[5], STYLE.paper, 60) > 20
    assert has(corner[1], STYLE.paper, 60) == 0


@pytest.mark.parametrize("size", [(120, 160), (480, 640), (2160, 3840), (90, 2000)])
def test_sheets_are_of_a_handy_size(trace_of, size, textured):
    sheet = viz.draw_stages(trace_of(size, textured(*size)))
    assert 600 < sheet.shape[1] < 4000


def test_input_is_left_alone(trace_of, textured):
    image = textured(120, 160)
    trace = trace_of(image=image)
    before = image.copy(), trace.mask.copy(), trace.cleaned.copy()
    first, second = viz.draw_stages(trace), viz.draw_stages(trace)
    assert np.array_equal(first, second)
    assert all(np.array_equal(a, b) for a, b in zip(before, (image, trace.mask, trace.cleaned), strict=True))


def test_the_view_closes_in_on_a_small_object():
    mask = np.zeros((720, 1280), bool)
    mask[300:320, 500:600] = True
    view = View.around(mask, 700)
    assert view.left < 500
    assert view.left + view.width > 600
    assert view.top < 300
    assert view.top + view.height > 320
    assert view.zoom == round(700 / view.width)


def test_the_view_stays_inside_of_the_frame():
    mask = np.zeros((100, 400), bool)
    mask[0, 0:20] = mask[0:20, 0] = True
    view = View.around(mask, 300)
    assert (view.left, view.top) == (0, 0)
    mask[:] = False
    mask[95:, 390:] = True
    view = View.around(mask, 300)
    assert view.left + view.width == 400
    assert view.top + view.height == 100


@pytest.mark.parametrize("filled", [False, True])
def test_the_view_is_the_whole_frame_where_nothing_or_much_is_set(filled):
    view = View.around(np.full((100, 300), filled), 600)
    assert view == View(0, 0, 300, 100, 2.0)


@pytest.mark.parametrize("zoom", [1.0, 2.0, 5.0])
def test_points_land_in_the_middle_of_their_enlarged_pixels(zoom, build):
    view = View(10, 20, 30, 40, zoom)
    mask = np.zeros((100, 100), bool)
    mask[33, 21] = True
    y, x = np.nonzero(view.mask(mask))
    assert np.allclose(view.points(np.array([[21.0, 33.0]])), [[x.mean(), y.mean()]])
    curve = build.curve(build.straight((12, 25), (35, 50)))
    assert np.allclose(view.curve(curve).sample(9), view.points(curve.sample(9)))


def test_single_pixels_survive_reduction():
    mask = np.zeros((2000, 2000), bool)
    mask[1001, 777] = True
    assert View(0, 0, 2000, 2000, 0.3).mask(mask).any()


def test_points_beyond_the_frame_are_left_out(trace_of):
    trace = trace_of()
    height, width = trace.mask.shape
    outside = Segment(np.array([[-3.0, 5.0], [5.0, height + 0.6], [width + 2.0, 4.0]]), np.ones(3))
    picture = viz.draw_stages(replace(trace, segments=(*trace.segments, outside)))  # raised IndexError
    assert picture.shape == viz.draw_stages(trace).shape
