"""What `draw` leaves in a picture, pixel by pixel."""

from __future__ import annotations

from dataclasses import replace
from functools import reduce

import cv2
import numpy as np
import pytest

from dloftbs import viz
from dloftbs.data.centerline import JointKind
from dloftbs.data.curve import BSplineCurve
from dloftbs.data.detection import Crossing, Detection
from dloftbs.data.frame import Frame
from dloftbs.data.frame_result import FrameResult
from dloftbs.data.tracks import TrackState
from dloftbs.errors import InputError
from dloftbs.viz.items import bare_items_of, items_of

SIZE = (240, 640)
GREY = np.full((*SIZE, 3), 128, np.uint8)
STYLE = viz.Style()
PEN = STYLE.scaled(SIZE)


def is_colour(picture, colour, tolerance=40):
    return (np.abs(picture.astype(int) - colour) <= tolerance).all(axis=2)


def is_touched(picture, before=GREY):
    return (picture != before).any(axis=2)


def distance_to(points, size=SIZE):
    """Distance of every pixel to the nearest of the points, by brute force."""
    y, x = np.mgrid[: size[0], : size[1]]
    return reduce(np.minimum, (np.hypot(x - p[0], y - p[1]) for p in points))


@pytest.fixture
def wave(build):
    x = np.linspace(60, 580, 300)
    return build.detection(np.stack((x, 120 + 60 * np.sin(x / 70)), axis=1))


@pytest.fixture
def flat(build):
    return build.straight((100, 120), (540, 120))


def test_input_is_left_alone(build, wave, textured):
    image = textured(*SIZE)
    image.flags.writeable = False
    before = image.copy()
    picture = viz.draw(image, build.result(SIZE, (wave,)))
    assert np.array_equal(image, before)
    assert picture.flags.writeable
    assert picture.dtype == np.uint8
    assert picture.shape == image.shape


def test_same_result_gives_same_picture(build, wave, textured):
    result = build.result(SIZE, (wave,))
    assert np.array_equal(viz.draw(textured(*SIZE), result), viz.draw(textured(*SIZE), result))


def test_line_lies_on_the_curve_and_nowhere_else(build, wave):
    picture = viz.draw(GREY, build.result(SIZE, (wave,)))
    dense = wave.curve.sample(600)
    on_curve = is_colour(picture, STYLE.colour(0), 90)
    x, y = np.rint(wave.curve(np.linspace(0.02, 0.95, 200))).astype(int).T
    near = cv2.dilate(on_curve.astype(np.uint8), np.ones((3, 3), np.uint8)) > 0
    assert near[y, x].all()
    # The label sits beside the start, so the left end is left out.
    right = np.arange(SIZE[1]) > 120
    away = distance_to(dense)
    assert away[on_curve & right].max() < PEN.arrow_px
    assert away[is_touched(picture) & right].max() < PEN.arrow_px + 2 * PEN.halo_px + PEN.line_px


def test_stroke_is_thin_and_rimmed(build, flat):
    picture = viz.draw(GREY, build.result(SIZE, (build.detection(flat),)))
    column = picture[:, 125].astype(int)  # between the start and the first arrow
    line = np.flatnonzero((np.abs(column - STYLE.colour(0)) < 60).all(axis=1))
    assert line.min() >= 119
    assert line.max() <= 121
    assert (column[[117, 118, 122, 123]].sum(axis=1) < 3 * 128).any()
    assert (column[:115] == 128).all()
    assert (column[126:] == 128).all()


def test_line_of_a_thin_object_is_thinner(build, textured):
    size = (1080, 1920)
    points = build.straight((300, 540), (1700, 540))

    def painted(width):
        picture = viz.draw(
            np.full((*size, 3), 128, np.uint8), build.result(size, (build.detection(points, (), width),))
        )
        return int(is_colour(picture, STYLE.colour(0))[:, 335].sum())

    assert painted(4.0) < painted(40.0)


def test_start_is_full_and_end_is_hollow(build, flat):
    picture = viz.draw(GREY, build.result(SIZE, (build.detection(flat),)))
    ours = is_colour(picture, STYLE.colour(0))
    assert ours[118:123, 98:103].all()
    assert not ours[120, 540]
    assert ours[110:131, 530:551].sum() > 10


def test_a_closed_curve_has_no_ends(build, wave):
    circle = build.circle((320, 120), 80)
    detection = Detection(wave.centerline, circle)
    picture = viz.draw(GREY, build.result(SIZE, (detection,)))
    touched = is_touched(picture)
    start = circle(0.0)
    y, x = np.mgrid[: SIZE[0], : SIZE[1]]
    inner = np.hypot(x - 320, y - 120) < 0.8 * np.hypot(*(start - (320, 120)))
    assert not touched[inner].any()
    assert touched[round(start[1]), round(start[0])]


def test_gaps_are_dashed_and_the_rest_is_solid(build, flat):
    gap = (0.3, 0.6)
    picture = viz.draw(GREY, build.result(SIZE, (build.detection(flat, ((JointKind.GAP, gap),)),)))
    row = picture[120]
    low, high = (round(100 + 440 * u) for u in gap)
    bare = (row == 128).all(axis=1)
    ours = (np.abs(row.astype(int) - STYLE.colour(0)) < 60).all(axis=1)
    assert not bare[100 : low - 5].any()
    assert not bare[high + 5 : 530].any()
    assert 0.1 < bare[low:high].mean() < 0.7
    assert ours[low:high].mean() > 0.2
    assert np.count_nonzero(np.diff(bare[low:high].astype(int)) == 1) >= 3


def test_crossings_get_a_hollow_mark(build, flat):
    plain = viz.draw(GREY, build.result(SIZE, (build.detection(flat),)))
    marked = viz.draw(GREY, build.result(SIZE, (build.detection(flat, ((JointKind.CROSSING, (0.4, 0.44)),)),)))
    x = round(100 + 440 * 0.42)
    radius = round(1.6 * PEN.marker_px)
    assert is_colour(marked, STYLE.colour(0), 90)[120 - radius - 1 : 120 - radius + 2, x].any()
    assert not is_colour(plain, STYLE.colour(0), 90)[120 - radius - 1 : 120 - radius + 2, x].any()
    assert not (marked[120, x - 12 : x + 12] == 128).all(axis=1).any()


def crossed(build, flat, steep, top, *, tracks=False):
    """Draw two curves that cross at (320, 120); with tracks, the second one runs against its detection."""
    detections = (build.detection(flat), build.detection(steep))
    crossing = Crossing((320.0, 120.0), ((0, 0.5), (1, 0.5)), top, 0.0 if top is None else 0.8)
    seen = (build.track(1, detections[0]), build.track(2, detections[1].reversed())) if tracks else ()
    return viz.draw(GREY, FrameResult(detections, seen, None, SIZE, crossings=(crossing,)))


@pytest.mark.parametrize("tracks", [False, True])
@pytest.mark.parametrize("top", [0, 1])
def test_the_curve_below_is_interrupted(build, flat, top, tracks):
    steep = build.straight((320, 20), (320, 220))
    picture = crossed(build, flat, steep, top, tracks=tracks)
    for index in (0, 1):
        ours = is_colour(picture, STYLE.colour(index), 90)
        along = ours[120, 308:333] if index == 0 else ours[108:133, 320]
        assert along[[0, 24]].all()
        assert along[8:17].all() if index == top else not along[8:17].any()


def test_a_track_that_runs_backwards_is_interrupted_where_its_detection_is(build, flat):
    crossing = Crossing((188.0, 120.0), ((0, 0.2), (1, 0.5)), 1, 0.8)
    detection, other = build.detection(flat), build.detection(build.straight((188, 20), (188, 220)))
    tracks = (build.track(1, detection.reversed()), build.track(2, other))
    picture = viz.draw(GREY, FrameResult((detection, other), tracks, None, SIZE, crossings=(crossing,)))
    ours = is_colour(picture, STYLE.colour(0), 90)[120]
    assert not ours[184:193].any()
    assert ours[448:457].all()


def test_a_crossing_of_unknown_order_has_a_small_ring_and_no_gap(build, flat):
    steep = build.straight((320, 20), (320, 220))
    picture = crossed(build, flat, steep, None)
    pale = is_colour(picture, STYLE.paper, 40)
    assert 4 <= pale[110:131, 310:331].sum() < 80
    assert not pale[:, :300].any()
    bare = (picture == 128).all(axis=2)
    assert not bare[120, 310:331].any()
    assert not bare[110:131, 320].any()


def test_a_joint_at_a_crossing_needs_no_diamond(build, flat):
    linked = build.detection(flat, ((JointKind.CROSSING, (0.48, 0.52)),))
    other = build.detection(build.straight((320, 20), (320, 220)))
    crossing = Crossing((320.0, 120.0), ((0, 0.5), (1, 0.5)), 0, 0.8)
    with_joint = viz.draw(GREY, FrameResult((linked, other), (), None, SIZE, crossings=(crossing,)))
    y, x = 120 - round(1.6 * PEN.marker_px / 2), 320 + round(1.6 * PEN.marker_px / 2)
    assert not is_colour(with_joint, STYLE.colour(0), 90)[y - 1 : y + 2, x - 1 : x + 2].any()


def test_arrows_point_from_start_to_end(build, flat):
    def head(points):
        picture = viz.draw(GREY, build.result(SIZE, (build.detection(points),)))
        body = is_colour(picture, STYLE.colour(0), 90)[:, 195:226].sum(axis=0)  # six arrows, the second at x = 210
        return body[body > body.min() + 1]

    forth, back = head(flat), head(flat[::-1])
    # The barbs are at the rear: the arrow is widest near the side that it comes from.
    assert np.argmax(forth) < len(forth) / 2
    assert np.argmax(back) >= len(back) / 2


def test_tracks_come_before_detections_and_keep_their_colour(build, flat):
    detection = build.detection(flat)
    picture = viz.draw(GREY, build.result(SIZE, (detection,), (build.track(3, detection),)))
    assert is_colour(picture, STYLE.colour(2))[120, 130]
    assert not is_colour(picture, STYLE.colour(0)).any()


def test_a_hidden_track_is_dashed_and_dimmer(build, flat):
    hidden = build.track(1, build.detection(flat), TrackState.HIDDEN)
    picture = viz.draw(GREY, build.result(SIZE, (), (hidden,)))
    row = picture[120, 100:530]
    bare = (row == 128).all(axis=1)
    assert 0.1 < bare.mean() < 0.7
    assert row[~bare].max() < max(STYLE.colour(0)) - 20


def test_a_hidden_track_fades_and_says_since_when(build, flat):
    hidden = build.track(1, build.detection(flat), TrackState.HIDDEN)

    def drawn(misses, confidence):
        track = replace(hidden, misses=misses, confidence=confidence)
        picture = viz.draw(GREY, build.result(SIZE, (), (track,)))
        plate = is_touched(picture)[:105].any(axis=0)  # above the line
        return picture[120, 150:500].max(), int(plate.sum())

    sure, unsure = drawn(1, 1.0), drawn(1, 0.0)
    assert unsure[0] < sure[0] - 30
    assert drawn(12, 1.0)[1] > sure[1]  # a digit more
    seen = viz.draw(GREY, build.result(SIZE, (), (build.track(1, build.detection(flat)),)))
    assert sure[1] > is_touched(seen)[:105].any(axis=0).sum()


def hidden_from(build, flat, low, high, **others):
    """A track of the whole flat line, of which only ``low..high`` is seen; the track runs as the line does."""
    seen = build.detection(flat[(flat[:, 0] >= low) & (flat[:, 0] <= high)], **others)
    spans = (((0.0, (low - 100) / 440),) if low > 100 else ()) + ((((high - 100) / 440, 1.0),) if high < 540 else ())
    return seen, replace(build.track(1, seen), curve=build.curve(flat), inferred=spans)


def test_what_a_track_knows_of_its_hidden_part_is_dashed(build, flat):
    seen, track = hidden_from(build, flat, 230, 400)
    row = viz.draw(GREY, build.result(SIZE, (seen,), (track,)))[120]
    bare = (row == 128).all(axis=1)
    assert not bare[236:394].any()
    for hidden in (bare[106:224], bare[406:528]):
        assert 0.1 < hidden.mean() < 0.7
        assert np.count_nonzero(np.diff(hidden.astype(int)) == 1) >= 3


def test_crossings_of_a_part_are_where_they_are_on_the_whole(build, flat):
    seen, track = hidden_from(build, flat, 230, 540)
    other = build.detection(build.straight((385, 20), (385, 220)))
    crossing = Crossing((385.0, 120.0), ((0, 0.5), (1, 0.5)), 1, 0.8)
    backwards = build.detection(flat[flat[:, 0] >= 230][::-1])
    for found, in_track in ((seen, seen), (backwards, backwards.reversed())):
        followed = replace(track, detection=in_track)
        result = FrameResult((found, other), (followed, build.track(2, other)), None, SIZE, crossings=(crossing,))
        ours = is_colour(viz.draw(GREY, result), STYLE.colour(0), 90)[120]
        assert not ours[381:390].any()
        assert ours[[365, 405]].all()


def test_gaps_and_inferred_parts_may_overlap(build, flat):
    seen = build.detection(flat, ((JointKind.GAP, (0.3, 0.6)),))
    track = replace(build.track(1, seen), inferred=((0.0, 0.1), (0.25, 0.5)))
    bare = (viz.draw(GREY, build.result(SIZE, (seen,), (track,)))[120] == 128).all(axis=1)
    assert 0.1 < bare[212:362].mean() < 0.7
    assert not bare[368:528].any()
    assert bare[106:140].any()


def test_the_label_is_inside_of_the_picture_in_every_corner(build):
    height, width = SIZE
    for start in ((0, 0), (width - 1, 0), (0, height - 1), (width - 1, height - 1)):
        points = build.straight(start, (width / 2, height / 2))
        picture = viz.draw(GREY, build.result(SIZE, (build.detection(points),)))
        assert is_colour(picture, STYLE.ink, 60).sum() > 5
        assert is_colour(picture, STYLE.colour(0), 3).sum() > 100


@pytest.mark.parametrize(("confidence", "label"), [(1.0, "0"), (0.951, "0"), (0.949, "0: 95 %"), (0.62, "0: 62 %")])
def test_a_label_has_the_confidence_where_that_is_not_sure(wave, build, confidence, label):
    detection = replace(wave, centerline=replace(wave.centerline, course_confidence=confidence))
    (item,) = items_of(build.result(SIZE, (detection,)), STYLE)
    assert item.label == label
    assert [one.label for one in bare_items_of([detection], STYLE)] == [label]


def test_labels_do_not_cover_each_other(build):
    both = tuple(build.detection(build.straight((300, 120), (20, y))) for y in (60, 180))
    picture = viz.draw(GREY, build.result(SIZE, both))
    plates = [
        cv2.connectedComponentsWithStats(is_colour(picture, STYLE.colour(i), 0).astype(np.uint8))[2][1:, :].tolist()
        for i in range(2)
    ]
    assert all(max(component[3] for component in components) >= 12 for components in plates)


@pytest.mark.parametrize(
    ("start", "end"),
    [((-300, -50), (900, 300)), ((-500, -500), (-100, -400)), ((1e7, 0), (-1e7, 200)), ((320, 120), (1e12, 1e12))],
)
def test_curves_may_leave_the_picture(build, start, end):
    detection = build.detection(build.straight(start, end), ((JointKind.GAP, (0.2, 0.3)),))
    picture = viz.draw(GREY, build.result(SIZE, (detection,)), control_points=True)
    assert picture.shape == GREY.shape


def test_what_is_outside_leaves_no_trace(build):
    detection = build.detection(build.straight((-500, -500), (-100, -400)))
    assert np.array_equal(viz.draw(GREY, build.result(SIZE, (detection,))), GREY)


def test_a_curve_of_no_length_is_a_dot(build, wave):
    curve = BSplineCurve([0, 0, 0, 0, 1, 1, 1, 1], np.full((4, 2), 100.0))
    picture = viz.draw(GREY, build.result(SIZE, (Detection(wave.centerline, curve),)))
    assert is_colour(picture, STYLE.colour(0))[100, 100]


def test_control_points_are_drawn_on_demand(build, wave):
    result = build.result(SIZE, (wave,))
    without, with_them = viz.draw(GREY, result), viz.draw(GREY, result, control_points=True)
    changed = (without != with_them).any(axis=2)
    for x, y in wave.curve.control_points[2:-2]:
        assert changed[round(y) - 4 : round(y) + 5, round(x) - 4 : round(x) + 5].any()


def test_the_reason_is_written_into_the_lower_left_corner(build):
    picture = viz.draw(GREY, build.result(SIZE, reason="the mask is empty"))
    touched = is_touched(picture)
    y, x = np.nonzero(touched)
    assert y.min() > 0.85 * SIZE[0]
    assert x.min() == 0
    assert is_colour(picture, STYLE.paper, 80).sum() > 20


def test_a_long_reason_fits_into_a_small_picture(build):
    picture = viz.draw(np.zeros((60, 80), bool), build.result((60, 80), reason="nothing at all was found " * 10))
    assert picture.shape == (60, 80, 3)


def test_nothing_and_no_reason_leaves_the_picture_as_it_was(build):
    assert np.array_equal(viz.draw(GREY, build.result(SIZE)), GREY)


@pytest.mark.parametrize("kind", [bool, np.uint8, np.int32])
def test_masks_show_as_dim_grey(build, kind):
    mask = np.zeros(SIZE, kind)
    mask[50:60] = 1
    expected = np.where(mask[..., None] != 0, np.uint8(STYLE.mask), np.uint8(STYLE.ink))
    for picture in (mask, mask[:, :, None], Frame(mask=mask)):
        assert np.array_equal(viz.draw(picture, build.result(SIZE)), expected)


def test_a_probability_shows_from_one_half_on(build):
    mask = np.full(SIZE, 0.02)
    mask[50:60] = 0.9
    expected = np.where(mask[..., None] > 0.5, np.uint8(STYLE.mask), np.uint8(STYLE.ink))
    assert np.array_equal(viz.draw(Frame(mask=mask), build.result(SIZE)), expected)


def test_an_array_shows_as_a_frame_of_it_does(build):
    mask = np.zeros(SIZE, np.uint8)
    mask[40:60] = (np.hanning(20) * 255).astype(np.uint8)[:, None]
    shown = viz.draw(mask, build.result(SIZE))
    assert np.array_equal(shown, viz.draw(mask >= 128, build.result(SIZE)))


def test_a_frame_shows_its_image_before_its_mask(build, textured):
    image = textured(*SIZE)
    frame = Frame(image=image, mask=np.ones(SIZE, bool))
    assert np.array_equal(viz.draw(frame, build.result(SIZE)), image)


def test_sizes_grow_with_the_picture(build):
    def share(scale):
        size = (round(720 * scale), round(1280 * scale))
        points = build.straight((200 * scale, 360 * scale), (1000 * scale, 360 * scale))
        result = build.result(size, (build.detection(points, (), 40 * scale),))
        picture = viz.draw(np.full((*size, 3), 128, np.uint8), result)
        return is_touched(picture, np.uint8(128)).mean()

    assert share(3.0) == pytest.approx(share(1.0), rel=0.15)


@pytest.mark.parametrize(
    ("picture", "message"),
    [
        (np.zeros((10, 20, 3), np.uint8), r"result's size \(240, 640\).*got \(10, 20\)"),
        (np.zeros((*SIZE, 4), np.uint8), r"\(H, W, 3\).*got \(240, 640, 4\)"),
        (np.zeros((*SIZE, 3), np.float32), "uint8, got .*float32"),
        (np.zeros(SIZE, np.float32), "bool or integer.*float32"),
        (np.zeros((0, 640), bool), "at least one pixel"),
        (None, r"the picture is None \(cv2\.imread returns None"),
    ],
)
def test_wrong_pictures_are_refused(build, picture, message):
    with pytest.raises(InputError, match=message):
        viz.draw(picture, build.result(SIZE))


@pytest.mark.parametrize("result", [5, None, "x", [5], ["x"], [None]])
def test_wrong_results_are_refused(result):
    with pytest.raises(InputError, match=r"expected a FrameResult, or tracks|what is drawn must be a BSplineCurve"):
        viz.draw(GREY, result)


def test_a_curve_in_space_is_not_drawn_over_a_picture(build):
    with pytest.raises(InputError, match="what is drawn must be a BSplineCurve with 2 dimensions, got BSplineCurve"):
        viz.draw(GREY, BSplineCurve([0, 0, 0, 0, 1, 1, 1, 1], np.ones((4, 3))))


def test_detections_and_tracks_are_drawn_as_those_of_a_result(build, flat, wave):
    other = build.detection(flat)
    both = build.result(SIZE, (wave, other))
    np.testing.assert_array_equal(viz.draw(GREY, (wave, other)), viz.draw(GREY, both))
    np.testing.assert_array_equal(viz.draw(GREY, both.detections), viz.draw(GREY, both))
    tracks = build.track(3, wave), build.track(8, other, TrackState.HIDDEN)
    np.testing.assert_array_equal(viz.draw(GREY, tracks), viz.draw(GREY, build.result(SIZE, (), tracks)))
    np.testing.assert_array_equal(viz.draw(GREY, wave), viz.draw(GREY, [wave]))
    np.testing.assert_array_equal(viz.draw(GREY, iter(tracks[:1])), viz.draw(GREY, tracks[0]))
    np.testing.assert_array_equal(viz.draw(GREY, []), GREY)


def test_bare_curves_are_drawn_in_the_colours_of_their_places(build, wave):
    shifted = wave.curve.transformed(np.eye(2), (0.0, 40.0))
    picture = viz.draw(GREY, [wave.curve, shifted], control_points=True)
    for number, curve in enumerate((wave.curve, shifted)):
        x, y = np.rint(curve(0.137)).astype(int)
        assert is_colour(picture, STYLE.colour(number))[y - 1 : y + 2, x - 1 : x + 2].any()
    frame = Frame(image=GREY, mask=np.zeros(SIZE, bool))
    np.testing.assert_array_equal(viz.draw(frame, wave.curve), viz.draw(GREY, [wave.curve]))


def test_a_track_of_a_bare_curve_is_not_drawn_as_hidden(build, wave):
    seen = replace(build.track(1, wave), detection=None, inferred=((0.4, 0.6),))
    picture = viz.draw(GREY, seen)
    x, y = np.rint(wave.curve(0.137)).astype(int)
    assert is_colour(picture, STYLE.colour(0))[y - 1 : y + 2, x - 1 : x + 2].any()
    middle = np.rint(wave.curve(np.linspace(0.42, 0.58, 60))).astype(int)
    assert not is_touched(picture)[middle[:, 1], middle[:, 0]].all()
