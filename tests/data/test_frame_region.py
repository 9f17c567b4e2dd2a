"""Frames cut to a region of interest."""

from __future__ import annotations

import numpy as np
import pytest

from dloftbs import Frame, InputError, PinholeCamera
from dloftbs.data.frame_region import Region, distances_to

SIZE = (60, 80)
DIAMOND = ((40, 10), (60, 30), (40, 50), (20, 30))


def test_a_rectangle_is_a_view():
    image = np.arange(60 * 80 * 3, dtype=np.uint32).astype(np.uint8).reshape(60, 80, 3)
    frame = Frame(image=image, depth=np.ones(SIZE, np.float32), camera=PinholeCamera(50, 50, 40, 30, size=SIZE))
    cut = Region((10, 5, 30, 20), SIZE).crop(frame)
    assert np.array_equal(cut.image, image[5:25, 10:40])
    assert np.shares_memory(cut.image, image)
    assert np.shares_memory(cut.depth, frame.depth)
    assert (cut.camera.cx, cut.camera.cy, cut.camera.size) == (30, 25, (20, 30))


def test_instances_are_cut_with_the_rest():
    labels = np.arange(60 * 80, dtype=np.uint16).reshape(SIZE)
    cut = Region((10, 5, 30, 20), SIZE).crop(Frame(instances=labels))
    assert np.array_equal(cut.instances, labels[5:25, 10:40])
    assert np.array_equal(cut.mask, labels[5:25, 10:40] != 0)


@pytest.mark.parametrize("distortion", [(), (0.1, -0.05, 0.001, 0.002)])
def test_a_pixel_is_the_same_place_in_space(distortion):
    camera = PinholeCamera(50, 50, 40, 30, distortion, size=SIZE)
    cut = Region((10, 5, 30, 20), SIZE).crop(Frame(mask=np.ones(SIZE, np.uint8), camera=camera)).camera
    place = cut.deproject([3.0, 4.0], 1.5)
    np.testing.assert_allclose(place, camera.deproject([13.0, 9.0], 1.5), atol=1e-12)


def test_a_lens_is_prepared_once_for_a_camera():
    region, camera = Region((10, 5, 30, 20), SIZE), PinholeCamera(50, 50, 40, 30)
    first, second = (region.crop(Frame(mask=np.ones(SIZE, np.uint8), camera=camera)).camera for _ in range(2))
    assert first is second


def test_a_polygon_has_its_edges_and_no_depth_outside():
    region = Region(DIAMOND, SIZE)
    assert (region.box, region.origin, region.size) == ((20, 10, 41, 41), (20, 10), (41, 41))
    rows, columns = np.mgrid[:41, :41]
    expected = abs(rows - 20) + abs(columns - 20) <= 20
    assert np.array_equal(region.inside != 0, expected)
    assert region.share == expected.mean()
    cut = region.crop(Frame(mask=np.ones(SIZE, np.uint8), depth=np.ones(SIZE, np.uint16)))
    assert np.array_equal(cut.depth != 0, expected)
    whole = region.paste(np.ones((41, 41), np.uint8))
    assert whole.shape == SIZE
    assert whole.sum() == expected.sum()


@pytest.mark.parametrize(
    ("roi", "said"),
    [
        ((70, 0, 20, 10), "within is 70,0,10,10"),
        ((-5, 0, 20, 10), "within is 0,0,15,10"),
        ((0, 55, 10, 10), "within is 0,55,10,5"),
        ((80, 0, 5, 5), "none of it is within"),
        (((0, 0), (80, 0), (5, 5)), "around its polygon"),
    ],
)
def test_it_must_lie_within_the_image(roi, said):
    with pytest.raises(InputError, match=f"80 x 60 px.*{said}"):
        Region(roi, SIZE)


def test_the_whole_image_is_a_region():
    assert Region((0, 0, 80, 60), SIZE).share == 1.0
    assert Region(((0, 0), (79, 0), (79, 59), (0, 59)), SIZE).share == 1.0


def test_distances_to_an_outline():
    square = np.array([(0.0, 0.0), (10.0, 0.0), (10.0, 10.0), (0.0, 10.0)])
    points = np.array([(5.0, 5.0), (1.0, 4.0), (9.0, 9.5), (13.0, 14.0)])
    np.testing.assert_allclose(distances_to(square, points), [5.0, 1.0, 0.5, 5.0])
