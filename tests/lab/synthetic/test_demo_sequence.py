from functools import cache

import cv2
import numpy as np
import pytest

from dloftbs.errors import InputError, SourceError
from dloftbs_lab.synthetic import DemoSequence, draw_tube_mask

SIZE = (360, 640)
WIDTH = 8.0
FRAMES = 30


@cache
def demo(seed=0, cables=2, occluder=True):
    return DemoSequence(FRAMES, SIZE, seed, cables, WIDTH, occluder)


@cache
def truth(index, seed=0, cables=2, occluder=True):
    return demo(seed, cables, occluder).truth(index)


@cache
def image(index, seed=0, cables=2, occluder=True):
    return demo(seed, cables, occluder).frame(index).image


def crossings(first, second=None):
    """Where two polylines (n, 2) meet, or one meets itself: rows of x, y, index on the first, on the second."""
    other = first if second is None else second
    a, b = first[:-1, None], np.diff(first, axis=0)[:, None]
    c, d = other[None, :-1], np.diff(other, axis=0)[None]
    cross = b[..., 0] * d[..., 1] - b[..., 1] * d[..., 0]
    cross = np.where(np.abs(cross) < 1e-12, np.nan, cross)
    gap = c - a
    s = (gap[..., 0] * d[..., 1] - gap[..., 1] * d[..., 0]) / cross
    t = (gap[..., 0] * b[..., 1] - gap[..., 1] * b[..., 0]) / cross
    hit = (s >= 0) & (s < 1) & (t >= 0) & (t < 1)
    if second is None:
        hit &= np.arange(len(first) - 1)[:, None] + 2 < np.arange(len(other) - 1)
    i, j = np.nonzero(hit)
    return [(*(first[m] + s[m, n] * (first[m + 1] - first[m])), m, n) for m, n in zip(i, j, strict=True)]


def in_range(picture, box):
    hsv = cv2.cvtColor(picture, cv2.COLOR_BGR2HSV)
    low, high = zip(box.hue, box.saturation, box.value, strict=True)
    return cv2.inRange(hsv, low, high) > 0


def test_frames_are_the_same_bit_for_bit_in_any_order():
    one, other = demo(), DemoSequence(FRAMES, SIZE, 0, 2, WIDTH)
    for index in (17, 3, 17, 0):
        np.testing.assert_array_equal(other.frame(index).image, image(index))
        for mask, again in zip(other.truth(index).visible_masks, one.truth(index).visible_masks, strict=True):
            np.testing.assert_array_equal(mask, again)
        assert other.truth(index).curves == one.truth(index).curves
    assert (image(3) != image(17)).any()
    assert (DemoSequence(FRAMES, SIZE, 1, 2, WIDTH).frame(3).image != image(3)).any()


def test_it_is_a_source_of_frames():
    with DemoSequence(3, (144, 256), width_px=3.0, fps=10.0) as source:
        frames = list(source)
        assert [f.name for f in frames] == ["demo#0000", "demo#0001", "demo#0002"]
        assert [f.stamp for f in frames] == [0.0, 0.1, 0.2]
        assert all(f.image.shape == (144, 256, 3) and f.image.dtype == np.uint8 for f in frames)
        assert (len(source), source.length, source.fps, source.skipped) == (3, 3, 10.0, 0)
        stream = iter(source)
        next(stream)
    assert list(stream) == []
    with pytest.raises(SourceError, match="is closed"):
        next(iter(source))


@pytest.mark.parametrize("seed", range(6))
def test_cables_keep_their_length_bend_gently_and_stay_inside(seed):
    lengths = []
    for index in range(0, FRAMES, 3):
        curves = truth(index, seed).curves
        lengths.append([curve.length for curve in curves])
        for curve in curves:
            points = curve.sample(500)
            assert (points > WIDTH).all()
            assert (points < np.array([SIZE[1], SIZE[0]]) - WIDTH).all()
            assert curve.curvature(np.linspace(0.02, 0.98, 300)).max() * 2 * WIDTH < 1.02
            np.testing.assert_allclose(
                np.linalg.norm(curve(np.linspace(0, 1, 300), 1), axis=1), curve.length, rtol=0.01
            )
    np.testing.assert_allclose(lengths, np.broadcast_to(lengths[0], np.shape(lengths)), rtol=5e-3)


def test_motion_is_smooth_and_the_end_meets_the_beginning():
    steps = []
    for index in range(FRAMES):
        now, then = truth(index).curves, truth((index + 1) % FRAMES).curves
        steps.append(
            [np.linalg.norm(a.sample(100) - b.sample(100), axis=1).mean() for a, b in zip(now, then, strict=True)]
        )
    # Thirty frames show what ninety do, three times as fast.
    assert np.max(steps) < 0.06 * SIZE[1]
    assert np.abs(np.diff(steps, axis=0)).max() < 0.5 * np.max(steps)


@pytest.mark.parametrize("seed", range(6))
def test_the_loop_and_the_second_cable_cross_during_a_part(seed):
    selves, others = [], []
    for index in range(FRAMES):
        first, second = (curve.sample(150) for curve in truth(index, seed).curves)
        selves.append(len(crossings(first)))
        others.append(len(crossings(first, second)))
    for counts in (selves, others):
        assert 0.2 * FRAMES < np.count_nonzero(counts) < 0.9 * FRAMES
    assert max(selves) == 1


def test_without_occluder_the_mask_is_the_whole_tube():
    for index in (0, FRAMES // 2):
        scene = truth(index, cables=1, occluder=False)
        tube = draw_tube_mask(scene.curves[0], WIDTH, SIZE)
        # The curve interpolates the strand to a hundredth of a pixel.
        assert np.count_nonzero(scene.visible_masks[0] ^ tube) <= 0.002 * tube.sum()


def test_occluders_hide_and_are_not_of_the_cables_colour():
    shares = []
    for index in range(0, FRAMES, 3):
        hidden = np.zeros(SIZE, bool)
        for mask, bare in zip(truth(index).visible_masks, truth(index, occluder=False).visible_masks, strict=True):
            assert not (mask & ~bare).any()
            hidden |= bare & ~mask
        shares.append(hidden.sum())
        core = cv2.erode(hidden.astype(np.uint8), np.ones((3, 3))) > 0
        seen = np.logical_or.reduce([in_range(image(index), box) for box in demo().hsv])
        assert np.count_nonzero(seen & core) <= 0.02 * core.sum()
    assert min(shares) > 0
    assert max(shares) > 10 * WIDTH**2


def test_the_second_cable_lies_on_top():
    checked = 0
    for index in range(FRAMES // 2, FRAMES - 6, 2):
        scene = truth(index, occluder=False)
        first, second = scene.curves
        for x, y, *_ in crossings(first.sample(300), second.sample(300)):
            spot = round(y), round(x)
            assert scene.visible_masks[1][spot]
            assert not scene.visible_masks[0][spot]
            assert in_range(image(index, occluder=False), demo().hsv[1])[spot]
            checked += 1
    assert checked >= 4


def test_the_later_pass_darkens_the_earlier_one_beside_the_crossing():
    ratios = []
    for index in range(FRAMES // 3, 2 * FRAMES // 3):
        curve = truth(index, cables=1, occluder=False).curves[0]
        for *_, low, high in crossings(curve.sample(400)):
            value = image(index, cables=1, occluder=False).max(axis=2).astype(float)
            means = []
            for u in (low / 399, high / 399):
                # Beside the crossing, between half a width and a whole one, at both sides.
                spots = curve(u + np.array([-0.8, -0.7, 0.7, 0.8]) * WIDTH / curve.length).round().astype(int)
                means.append(value[spots[:, 1], spots[:, 0]].mean())
            ratios.append(means[0] / means[1])
    assert len(ratios) >= 5
    assert np.median(ratios) < 0.9


@pytest.mark.parametrize("seed", range(3))
def test_hue_finds_the_cables_and_nothing_else(seed):
    overlap, false = [], []
    for index in range(1, FRAMES, 6):
        for box, mask in zip(demo(seed).hsv, truth(index, seed).visible_masks, strict=True):
            found = in_range(image(index, seed), box)
            overlap.append((found & mask).sum() / (found | mask).sum())
            near = cv2.dilate(mask.astype(np.uint8), np.ones((5, 5))) > 0
            false.append((found & ~near).mean())
    assert np.median(overlap) > 0.9
    assert min(overlap) > 0.8
    assert max(false) < 0.001


def test_the_mask_of_the_truth_shows_what_is_visible():
    frame = demo().frame(12)
    assert frame.mask is None
    assert (frame.index, frame.name) == (12, "demo#0012")
    first, second = truth(12).visible_masks
    np.testing.assert_array_equal(truth(12).mask, first | second)
    assert not (first & second).any()
    assert truth(12).ids == (0, 1)


@pytest.mark.parametrize("size", [(64, 96), (480, 270)])
def test_small_and_upright_images_work(size):
    source = DemoSequence(4, size, cables=1, width_px=1.5)
    assert source.frame(2).image.shape == (*size, 3)
    assert source.truth(2).visible_masks[0].any()
    assert len(source.hsv) == len(source.truth(2).curves) == 1


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"frames": 0}, "frames >= 1"),
        ({"cables": 3}, "cables 1 or 2"),
        ({"size": (20, 400)}, "at least 64 x 64"),
        ({"fps": 0.0}, "fps must be positive"),
        ({"width_px": 90.0}, "more tightly than two widths"),
    ],
)
def test_what_cannot_be_rendered_is_refused_at_once(change, message):
    with pytest.raises(InputError, match=message):
        DemoSequence(**change)


@pytest.mark.parametrize("method", ["frame", "truth"])
def test_there_is_no_frame_outside_of_the_sequence(method):
    for index in (-1, FRAMES):
        with pytest.raises(InputError, match=f"index must be in 0..{FRAMES - 1}, got {index}"):
            getattr(demo(), method)(index)
