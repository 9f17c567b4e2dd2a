"""A region of interest: what is read of the image, and where cables end at its edge."""

from __future__ import annotations

import cv2
import numpy as np
import pytest
import tubes
from builders import through_json
from drawings import draw_cable, wave

import dloftbs
from dloftbs import Config, Frame, FrameResult, InputError, Pipeline, viz
from dloftbs.data.detection import place_in
from dloftbs.data.tracks import EndKind
from dloftbs.pipeline.group import PipelineGroup

SIZE = (240, 320)
BOX = (60, 30, 200, 170)
AS_POLYGON = ((60, 30), (259, 30), (259, 199), (60, 199))
DIAMOND = ((160, 10), (290, 120), (160, 230), (30, 120))


def cut(array: np.ndarray, box=BOX) -> np.ndarray:
    x, y, w, h = box
    return np.ascontiguousarray(array[y : y + h, x : x + w])


def cables() -> np.ndarray:
    """Three cables that cross, one of them with a gap, over the edges of the box and within it."""
    mask = draw_cable(wave(SIZE, 1.0), 9, SIZE)
    cv2.line(mask, (120, 0), (140, 239), 1, 7)
    cv2.line(mask, (160, 60), (190, 70), 1, 7)
    cv2.line(mask, (202, 74), (232, 84), 1, 7)
    return mask


def red(mask: np.ndarray) -> np.ndarray:
    image = np.full((*mask.shape, 3), (70, 90, 60), np.uint8)
    image[mask != 0] = (30, 30, 220)
    return image


def moved(plain, x: int, y: int):
    """Return a result's plain values of the cut image as those of the whole one."""
    if isinstance(plain, dict):
        return {key: moved_value(key, value, x, y) for key, value in plain.items() if key != "stage_ms"}
    return [moved(one, x, y) for one in plain] if isinstance(plain, list) else plain


def moved_value(key, value, x, y):
    if key == "control_points" and len(value[0]) == 2:
        return [[px + x, py + y] for px, py in value]
    if key in ("position", "start", "end"):
        return [value[0] + x, value[1] + y]
    if key == "alternatives":
        return [None if point is None else [point[0] + x, point[1] + y] for point in value]
    return moved(value, x, y)


def same(found: FrameResult, expected: FrameResult, box=BOX) -> None:
    """Check that a result is another one, of the cut image, to the last bit, but for rounding of lengths."""
    one, other = moved(found.to_dict(), 0, 0), moved(expected.to_dict(), *box[:2])
    for plain in (one, other):
        for key in ("size", "roi", "name"):
            plain.pop(key)
    assert_equal(one, other)


def assert_equal(one, other):
    assert type(one) is type(other)
    if isinstance(one, dict):
        assert one.keys() == other.keys()
        for key in one:
            assert_equal(one[key], other[key])
    elif isinstance(one, list):
        assert len(one) == len(other)
        for pair in zip(one, other, strict=True):
            assert_equal(*pair)
    elif isinstance(one, float):
        assert one == pytest.approx(other, abs=1e-9)
    else:
        assert one == other


@pytest.mark.parametrize("config", [Config(), Config.paper(), Config().replace({"linking.objects": 2})])
@pytest.mark.parametrize("roi", [BOX, AS_POLYGON])
def test_it_is_the_reading_of_the_cut_image(config, roi):
    found, expected = dloftbs.detect(cables(), config=config, roi=roi), dloftbs.detect(cut(cables()), config=config)
    assert len(found) >= 2
    assert found.size == SIZE
    assert found.roi == roi
    same(found, expected)
    for one, other in zip(found, expected, strict=True):
        assert np.array_equal(one.curve.control_points, other.curve.control_points + BOX[:2])
        assert np.array_equal(one.centerline.points, other.centerline.points + BOX[:2])
        assert np.array_equal(one.curve.knots, other.curve.knots)
    assert found.frame.size == SIZE


def test_an_image_is_read_by_its_colour_there():
    image = red(cables())
    found = dloftbs.detect(image, hsv="red", roi=BOX)
    same(found, dloftbs.detect(cut(image), hsv="red"))
    image[:25] = image[205:] = (30, 30, 220)  # clutter that would be refused
    assert not dloftbs.detect(np.where(cables()[..., None], image, (30, 30, 220)).astype(np.uint8), hsv="red")
    same(dloftbs.detect(image, hsv="red", roi=BOX), found, (0, 0))


@pytest.mark.parametrize("roi", [BOX, DIAMOND])
def test_nothing_outside_of_it_counts(roi):
    mask = cables()
    other = np.random.default_rng(0).integers(0, 2, SIZE).astype(np.uint8)
    inside = np.zeros(SIZE, np.uint8)
    corners = AS_POLYGON if roi == BOX else DIAMOND
    cv2.fillPoly(inside, [np.array(corners)], 1)
    cluttered = np.where(inside, mask, other)
    same(dloftbs.detect(cluttered, roi=roi), dloftbs.detect(mask, roi=roi), (0, 0))
    pipeline = Pipeline(roi=roi)
    pipeline.process(cluttered)
    assert np.array_equal(pipeline.mask, np.where(inside, mask, 0))


def test_the_share_that_is_set_is_the_region_s():
    full = np.zeros(SIZE, np.uint8)
    full[60:180, 100:220] = 1
    assert "% of the mask is set" in dloftbs.detect(full, roi=(100, 60, 120, 120)).reason
    diamond = np.zeros(SIZE, np.uint8)
    cv2.fillPoly(diamond, [np.array(DIAMOND)], 1)
    assert diamond[10:231, 30:291].mean() < 0.6  # of the rectangle around it
    assert "100 % of the mask is set" in dloftbs.detect(diamond, roi=DIAMOND).reason


@pytest.mark.parametrize("roi", [BOX, DIAMOND])
def test_a_track_ends_at_its_edge_as_at_the_image_s_border(roi):
    pipeline = Pipeline(roi=roi)
    for number in range(3):
        result = pipeline.process(draw_cable(wave(SIZE, 1.0) + np.array([0, number]), 9, SIZE))
    (track,) = result.tracks
    assert track.ends == (EndKind.BORDER, EndKind.BORDER)
    assert track.detection.confidence > 0.9
    assert track.detection is result[0] or track.detection.curve == result[0].curve.reversed()
    assert track.velocity is not None


def test_the_parts_of_a_track_are_the_detections_of_the_whole_image():
    pipeline = Pipeline(roi=BOX)
    mask = draw_cable(np.array([(80.0, 110.0), (240.0, 120.0)]), 9, SIZE)
    for _ in range(4):
        pipeline.process(mask)
    mask[:, 110:210] = 0
    result = pipeline.process(mask)
    (track,) = result.tracks
    assert len(track._parts) == 2
    assert {place_in(result.detections, part.detection)[0] for part in track._parts} == {0, 1}
    assert any(part.detection is track.detection for part in track._parts)


def test_a_slanted_edge_eats_no_thin_cable_and_starts_no_gap():
    mask = np.zeros(SIZE, np.uint8)
    cv2.line(mask, (0, 120), (319, 120), 1, 3)
    (one,) = dloftbs.detect(mask, roi=DIAMOND)
    x = np.sort(np.array([one.curve.start[0], one.curve.end[0]]))
    np.testing.assert_allclose(x, (30, 290), atol=4.0)
    notch = ((10, 100), (150, 100), (160, 118), (170, 100), (310, 100), (310, 117), (170, 117), (160, 140), (150, 117))
    mask[:] = 0
    mask[106:111, 20:300] = 1
    ends = dloftbs.detect(mask, roi=(*notch, (10, 117)))
    assert len(ends) == 2  # cut by the notch, on both sides of it
    assert all(joint.kind.value != "gap" for one in ends for joint in one.joints)


def test_a_moving_cable_leaves_it_and_comes_back_under_its_id():
    pipeline = Pipeline(roi=(0, 0, 320, 120))
    ids, states = [], []
    for number in range(40):
        y = 90 + 40 * np.sin(2 * np.pi * number / 40)
        mask = np.zeros(SIZE, np.uint8)
        cv2.line(mask, (40, round(y)), (280, round(y + 20)), 1, 7)
        result = pipeline.process(Frame(mask=mask, index=number, stamp=number / 30))
        ids += [track.id for track in result.tracks]
        states.append(len(result.tracks))
        for track in result.tracks:
            assert track.curve.control_points[:, 1].max() < 124
    assert set(ids) == {1}
    assert 0 in states  # it was outside
    assert states[-1] == 1


def test_tracks_are_those_of_the_cut_frames():
    whole, parts = Pipeline(roi=BOX), Pipeline()
    for number in range(6):
        mask = draw_cable(wave(SIZE, 1.0, 0.02 * number), 9, SIZE)
        frame = Frame(mask=mask, image=red(mask), index=number, stamp=number / 30)
        found = whole.process(frame)
        same(found, parts.process(Frame(mask=cut(mask), image=cut(red(mask)), index=number, stamp=number / 30)))
    (track,) = found.tracks
    assert np.array_equal(track.curve.control_points, track.detection.curve.control_points)


def test_curves_in_space_stay_where_they_are():
    mask, depth = tubes.draw_tubes([tubes.coil()])
    rows, columns = np.nonzero(mask)
    box = (int(columns.min()) - 9, int(rows.min()) - 7, int(np.ptp(columns)) + 20, int(np.ptp(rows)) + 20)
    (whole,) = dloftbs.detect(mask, depth=depth, camera=tubes.CAMERA)
    (part,) = dloftbs.detect(mask, depth=depth, camera=tubes.CAMERA, roi=box)
    assert part.camera == tubes.CAMERA
    np.testing.assert_allclose(part.curve_3d.sample(50), whole.curve_3d.sample(50), atol=1e-4)
    np.testing.assert_allclose(part.u_3d([0.1, 0.5]), whole.u_3d([0.1, 0.5]), atol=1e-3)
    np.testing.assert_allclose(tubes.CAMERA.project(part.curve_3d.sample(50)), part.curve.sample(50), atol=6.0)


@pytest.mark.parametrize("roi", [BOX, DIAMOND])
def test_the_trace_is_in_the_whole_image(roi):
    trace = Pipeline(roi=roi).trace(cables())
    plain = Pipeline().trace(cables())
    assert trace.mask.shape == trace.cleaned.shape == SIZE
    assert not (trace.mask & ~plain.mask).any()
    x, y = trace.skeleton.astype(int).T
    assert trace.cleaned[y, x].all()
    assert trace.result.roi == roi
    assert trace.frame.size == SIZE
    assert viz.draw_stages(trace).ndim == 3


@pytest.mark.parametrize("roi", [BOX, DIAMOND])
def test_overlays_show_its_outline(roi):
    mask = cables()
    result = dloftbs.detect(mask, roi=roi)
    drawn = viz.draw(mask, result)
    bare = viz.draw(mask, FrameResult.from_dict({**result.to_dict(), "roi": None}))
    changed = (drawn != bare).any(axis=2)
    x, y = AS_POLYGON[0] if roi == BOX else DIAMOND[0]
    assert changed[y, x]
    assert not changed[0].any()
    assert "<polygon" in viz.show(result, mask).svg


def test_a_result_goes_through_json():
    for roi in (None, BOX, DIAMOND):
        result = dloftbs.detect(cables(), roi=roi)
        assert FrameResult.from_dict(through_json(result.to_dict())).roi == roi


def test_a_group_reads_the_region_too():
    mask = cables()
    config = Config.from_dict({"segmentation": {"hsv": "red"}, "region": {"roi": BOX}})
    result = PipelineGroup([config, config]).process(Frame(image=red(mask)))
    assert result.roi == BOX
    assert len(result) == 2 * len(dloftbs.detect(red(mask), hsv="red", roi=BOX))


@pytest.mark.parametrize("other", [None, DIAMOND])
def test_a_group_of_different_regions_states_none(other):
    image = red(cables())
    configs = [Config.from_dict({"segmentation": {"hsv": "red"}}).with_roi(roi) for roi in (BOX, other)]
    result = PipelineGroup(configs).process(Frame(image=image))
    alone = [detection.curve for config in configs for detection in dloftbs.detect(image, config=config)]
    assert [detection.curve for detection in result] == alone
    assert result.roi is None


def test_it_holds_for_frames_of_one_size():
    with pytest.raises(InputError, match="roi must lie within the image of 320 x 240 px"):
        dloftbs.detect(cables(), roi=(200, 100, 200, 100))
    pipeline = Pipeline(roi=BOX)
    pipeline.process(cables())
    with pytest.raises(InputError, match="reset the pipeline"):
        pipeline.process(np.zeros((480, 640), np.uint8))
    pipeline.reset()
    assert pipeline.process(np.zeros((480, 640), np.uint8)).size == (480, 640)


def test_a_stream_is_tracked_in_it():
    masks = [draw_cable(wave(SIZE, 1.0) + np.array([0, number]), 9, SIZE) for number in range(3)]
    results = list(dloftbs.track(masks, roi=BOX))
    assert [result.roi for result in results] == [BOX] * 3
    assert [track.id for result in results for track in result.tracks] == [1, 1, 1]


def test_the_default_reads_the_whole_image():
    assert dloftbs.detect(cables()).roi is None
    same(dloftbs.detect(cables(), roi=(0, 0, 320, 240)), dloftbs.detect(cables()), (0, 0))


def test_a_background_of_the_whole_place_is_cut_to_the_region(tmp_path):
    ground = np.random.default_rng(3).integers(90, 130, (*SIZE, 3)).astype(np.uint8)
    frame = ground.copy()
    frame[cables() != 0] = (30, 30, 220)
    cv2.imwrite(str(tmp_path / "empty.png"), ground)
    config = Config.from_dict({"segmentation": {"background": str(tmp_path / "empty.png")}})
    whole = Pipeline(config, roi=BOX).detect(frame)
    cv2.imwrite(str(tmp_path / "empty.png"), cut(ground))
    alone = Pipeline(config).detect(cut(frame))
    assert len(whole) == len(alone) > 0
    for one, other in zip(whole, alone, strict=True):
        np.testing.assert_array_equal(one.curve.control_points, other.curve.control_points + BOX[:2])


def test_a_grey_picture_is_an_image_for_local_masks():
    image = np.full(SIZE, 170, np.uint8)
    image[cables() != 0] = 120
    found = Pipeline(Config.from_dict({"segmentation": {"local": "darker"}})).detect(image)
    assert len(found) == len(Pipeline().detect(cables()))
