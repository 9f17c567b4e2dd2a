"""The depth above a plane: noise, tilt, holes, streams and cameras that move."""

import numpy as np
import pytest

import dloftbs
from dloftbs.config import Config, PlaneConfig, SegmentationConfig
from dloftbs.segmentation import make_segmenter
from dloftbs_lab.synthetic.depth_noise import TYPICAL_NOISE

PLANE = Config(segmentation=SegmentationConfig(plane=PlaneConfig(height_m=0.004)))
SIZE = 240, 320
CAMERA = dloftbs.PinholeCamera(600.0, 600.0, 159.5, 119.5)
SMALL = dloftbs.PinholeCamera(300.0, 300.0, 79.5, 59.5)
CABLE = np.zeros(SIZE, bool)
CABLE[110:120, 30:290] = True


def table(slope=(0.2, -0.1), distance=0.7, height=0.01):
    """Return true depth of a tilted table and of a flat strip above it."""
    y, x = np.mgrid[: SIZE[0], : SIZE[1]]
    across, down = (x - CAMERA.cx) / CAMERA.fx, (y - CAMERA.cy) / CAMERA.fy
    depth = distance / (1.0 + slope[0] * across + slope[1] * down)
    return np.where(CABLE, depth - height, depth).astype(np.float32)


def frame(depth):
    return dloftbs.Frame(image=np.zeros((*SIZE, 3), np.uint8), depth=depth, camera=CAMERA)


def small_frame(depth):
    """Return a frame of every second pixel, since kernels are slow as plain Python."""
    return dloftbs.Frame(image=np.zeros((120, 160, 3), np.uint8), depth=depth[::2, ::2], camera=SMALL)


def segmenter(height_m=0.005):
    return make_segmenter(SegmentationConfig(plane=PlaneConfig(height_m=height_m)))


def iou(mask):
    return np.sum(mask & CABLE) / np.sum(mask | CABLE)


@pytest.mark.parametrize("slope", [(0.0, 0.0), (0.4, 0.3), (-0.5, 0.1)])
def test_a_strip_is_found_on_a_tilted_table(slope):
    assert iou(segmenter()(frame(table(slope)))) > 0.99


@pytest.mark.parametrize("seed", range(3))
def test_it_is_found_in_a_cameras_noise(seed):
    depth = TYPICAL_NOISE.apply(table(), CABLE, np.random.default_rng(seed))
    assert iou(segmenter()(frame(depth))) > 0.9


def test_pixels_beyond_the_field_of_the_lens_have_no_height():
    lens = dloftbs.PinholeCamera(72.0, 72.0, 79.5, 59.5, distortion=(-0.4, 0.0, 0.0, 0.0))
    x, y, _ = lens.deproject(np.stack(np.meshgrid(np.arange(160), np.arange(120)), -1), np.ones((120, 160))).T
    beyond = np.isnan(x + y).T
    assert 0.05 < beyond.mean() < 0.8
    cable = CABLE[::2, ::2]
    depth = np.where(cable, 0.69, 0.7).astype(np.float32)
    mask = segmenter()(dloftbs.Frame(image=np.zeros((120, 160, 3), np.uint8), depth=depth, camera=lens)) != 0
    assert (mask[~beyond] == cable[~beyond]).mean() > 0.99


def test_more_noise_than_height_is_no_cable():
    rng = np.random.default_rng(0)
    flat = table(height=0.0) + rng.normal(0.0, 0.005, SIZE).astype(np.float32)
    assert np.mean(segmenter(0.001)(frame(flat))) < 0.001


def test_what_lies_lower_is_no_cable():
    assert not segmenter()(frame(table(height=-0.02)))[CABLE].any()


def test_millimetres_are_as_good_as_metres():
    depth = np.rint(1000.0 * table()).astype(np.uint16)
    assert iou(segmenter()(frame(depth))) > 0.97


def test_a_box_that_covers_a_third_does_not_become_the_plane():
    depth = table()
    depth[:70] = 0.5
    found = segmenter()(frame(depth))
    assert found[:60].mean() > 0.9
    assert found[CABLE].mean() > 0.99
    assert found[150:].mean() < 0.01


@pytest.mark.large
def test_the_plane_follows_a_camera_that_moves_and_one_that_jumps():
    ask = segmenter()
    for step in range(20):
        assert iou(ask(frame(table(distance=0.7 + 0.0005 * step)))) > 0.95
    assert iou(ask(frame(table((-0.3, 0.3), 0.5)))) > 0.99


def masks_of(pipeline, frames):
    masks = []
    for one in frames:
        pipeline.process(one)
        masks.append(pipeline.mask)
    return masks


def test_the_same_frames_give_the_same_masks_after_a_reset():
    rng = np.random.default_rng(0)
    frames = [small_frame(TYPICAL_NOISE.apply(table(), CABLE, rng)) for _ in range(3)]
    pipeline = dloftbs.Pipeline(PLANE)
    first = masks_of(pipeline, frames)
    pipeline.reset()
    np.testing.assert_array_equal(first, masks_of(pipeline, frames))


def test_a_frame_by_itself_has_its_own_plane_and_leaves_the_streams():
    straight, tilted = small_frame(table()), small_frame(table((0.3, -0.1)))
    pipeline, undisturbed = dloftbs.Pipeline(PLANE), dloftbs.Pipeline(PLANE)
    masks_of(pipeline, [straight])
    np.testing.assert_array_equal(pipeline.trace(tilted).mask, undisturbed.trace(tilted).mask)
    pipeline.detect(tilted)
    np.testing.assert_array_equal(masks_of(pipeline, [straight]), masks_of(undisturbed, [straight]))


def test_frames_of_another_size_begin_anew():
    ask = segmenter()
    ask(frame(table()))
    mask = ask(small_frame(table()))
    assert np.sum(mask & CABLE[::2, ::2]) / np.sum(mask | CABLE[::2, ::2]) > 0.95


@pytest.mark.parametrize("value", [0.0, np.nan])
def test_without_any_depth_there_is_no_cable(value):
    assert not segmenter()(frame(np.full(SIZE, value, np.float32))).any()
