"""Mask to crop."""

from __future__ import annotations

import io
from fractions import Fraction

import av
import cv2
import numpy as np
import pytest
from drawings import mask_from_text, random_mask, random_masks, versions
from hypothesis import given
from hypothesis import strategies as st
from skeletons import as_words, fast_skeleton, pasted, slow_degrees

from dloftbs import Config, Frame, Pipeline
from dloftbs.cleaning import clean
from dloftbs.cleaning.kernels.morphology import close
from dloftbs.config import CleaningConfig
from dloftbs.data.frame_region import Region
from dloftbs.data.mask_crop import MaskCrop
from dloftbs.kernels.bitmask import cut
from dloftbs_lab.synthetic import NOISY, Degradation, draw_tube_mask, random_curve

PAPER = Config.paper().cleaning


def to_image(crop: MaskCrop | None, size: tuple[int, int]) -> np.ndarray:
    """Put a crop back into an image of `size`."""
    image = np.zeros(size, dtype=np.uint8)
    if crop is not None:
        (x, y), (h, w) = crop.origin, crop.size
        image[y : y + h, x : x + w] = crop.pixels[1 : h + 1, 1 : w + 1]
    return image


def with_opencv(mask: np.ndarray, open_px: int, close_px: int) -> np.ndarray:
    """Clean the whole image, without any bounding box; what stays of the closing is the kernel's business."""
    mask = (mask != 0).astype(np.uint8)
    if close_px > 1 and mask.any():
        stripes, inside, x0, y0, _ = cut(as_words(mask), mask.shape[1], max(mask.shape))
        mask = pasted(close(stripes, inside, close_px // 2, 10**9), x0, y0, mask.shape)
    return cv2.morphologyEx(mask, cv2.MORPH_OPEN, np.ones((open_px, open_px), np.uint8))


@given(random_masks, st.sampled_from([1, 3, 5]), st.sampled_from([1, 3, 7]))
def test_cleaning_the_box_is_cleaning_the_image(mask: np.ndarray, open_px: int, close_px: int) -> None:
    crop = clean(mask, CleaningConfig(open_px=open_px, close_px=close_px, thin_px=0, fill_holes=False))
    np.testing.assert_array_equal(to_image(crop, mask.shape), with_opencv(mask, open_px, close_px))


@given(random_masks)
def test_the_box_is_tight_and_the_margin_empty(mask: np.ndarray) -> None:
    crop = clean(mask, CleaningConfig(open_px=1, close_px=1, fill_holes=False))
    if crop is None:
        assert not mask.any()
        return
    (h, w), pixels = crop.size, crop.pixels
    inner = pixels[1 : h + 1, 1 : w + 1]
    assert inner[0].any()
    assert inner[-1].any()
    assert inner[:, 0].any()
    assert inner[:, -1].any()
    assert pixels.sum() == inner.sum()
    assert pixels.shape[1] % 8 == 0


@pytest.mark.parametrize("dtype", [np.bool_, np.uint8, np.int8, np.uint16, np.int32, np.int64])
def test_any_non_zero_of_any_integer_type_is_cable(dtype: type) -> None:
    mask = random_mask(1, 60).astype(dtype)
    if dtype is not np.bool_:
        mask *= np.array(-7 if np.issubdtype(dtype, np.signedinteger) else 200).astype(dtype)
    before = mask.copy()
    crop = clean(mask, PAPER)
    np.testing.assert_array_equal(to_image(crop, mask.shape), with_opencv(mask, 3, 1))
    np.testing.assert_array_equal(mask, before)


def test_values_that_are_multiples_of_256_are_cable() -> None:
    mask = np.full((9, 9), 256, dtype=np.uint16)
    crop = clean(mask, CleaningConfig())
    assert crop is not None
    assert crop.pixels.sum() == 81


def test_masks_that_are_not_contiguous() -> None:
    mask = random_mask(5, 80)
    for view in (mask[::2, ::3], mask.T, mask[::-1]):
        np.testing.assert_array_equal(to_image(clean(view, PAPER), view.shape), with_opencv(view, 3, 1))


@pytest.mark.parametrize("mask", [np.zeros((5, 5), bool), np.zeros((0, 7), bool), np.eye(9, dtype=bool)])
def test_nothing_left_is_none(mask: np.ndarray) -> None:
    assert clean(mask, PAPER) is None


@pytest.mark.large
@pytest.mark.parametrize("specks", range(14300, 14900, 50))
def test_where_a_mask_lies_in_the_image_does_not_decide_whether_it_is_noise(specks: int) -> None:
    here = np.zeros((700, 760), dtype=np.uint8)
    here[50:52, 64:670] = 1  # a cable that the opening takes, and that is put back unless all is noise
    grid = here[56:650:4, 64:670:4]
    grid[np.unravel_index(np.arange(specks), grid.shape)] = 1
    here[649, 64] = 1
    kept = []
    for shift in range(8):
        crop = clean(np.roll(here, (shift, shift), axis=(0, 1)), CleaningConfig())
        kept.append(0 if crop is None else int(crop.pixels.sum()))
    assert kept in ([0] * 8, [2 * 606] * 8)


@pytest.mark.parametrize(("size", "cables", "apart"), [((480, 640), 8, 10), ((720, 1280), 3, 20), ((2160, 3840), 1, 0)])
def test_thin_cables_all_across_the_image_are_no_noise(size: tuple[int, int], cables: int, apart: int) -> None:
    mask = np.zeros(size, np.uint8)
    for top in 100 + apart * np.arange(cables):
        mask[top : top + 2, 20:-20] = 1
    np.testing.assert_array_equal(to_image(clean(mask, CleaningConfig()), size), mask)


def test_a_closing_fills_pin_holes() -> None:
    mask = np.ones((11, 11), dtype=np.uint8)
    mask[5, 5] = 0
    crop = clean(mask, CleaningConfig(close_px=3))
    assert crop is not None
    assert crop.pixels.sum() == 121


@pytest.mark.parametrize("gap", [1, 2])
def test_a_closing_does_not_join_cables_that_lie_close_together(gap: int) -> None:
    mask = np.zeros((60, 120), np.uint8)
    mask[10:20, 10:110] = mask[20 + gap : 30 + gap, 10:110] = 1
    np.testing.assert_array_equal(to_image(clean(mask, CleaningConfig()), mask.shape), mask)


def test_pepper_leaves_no_hole_and_splits_no_end_of_a_skeleton() -> None:
    ends, holes = 0, 0
    for seed in range(4):
        curve = random_curve(np.random.default_rng(seed), 300.0, (240, 320), min_radius_px=60.0)
        mask = draw_tube_mask(curve, 12.0, (240, 320))
        mask &= np.random.default_rng(seed).random(mask.shape) > 0.01
        skeleton = fast_skeleton(to_image(clean(mask, CleaningConfig()), mask.shape))
        ends += ((slow_degrees(skeleton) == 1) & (skeleton != 0)).sum()
        holes += cv2.connectedComponents(1 - skeleton, connectivity=4)[0] - 2
    assert holes == 0
    assert ends == 8


@pytest.mark.large
@pytest.mark.parametrize("share", [0.1, 0.15])
@pytest.mark.parametrize("size", [(480, 640), (720, 1280), (2160, 3840)])
def test_pepper_on_thick_cables_all_across_the_image_is_filled(size: tuple[int, int], share: float) -> None:
    mask = np.zeros(size, np.uint8)
    side = size[0] // 8
    for top in range(side // 2, size[0], 2 * side):
        mask[top : top + side, 20:-20] = 1
    peppered = mask & (np.random.default_rng(0).random(size) >= share)
    cleaned = to_image(clean(peppered, CleaningConfig()), size)
    inside = cv2.erode(mask, np.ones((9, 9), np.uint8)) != 0
    assert cleaned[inside].mean() > 0.999
    assert not cleaned[mask == 0].any()


@pytest.mark.large
@pytest.mark.parametrize("share", [0.1, 0.2, 0.3, 0.4, 0.5, 0.55])
@pytest.mark.parametrize("size", [(480, 640), (720, 1280), (2160, 3840)])
def test_nothing_is_filled_in_salt(size: tuple[int, int], share: float) -> None:
    salt = (np.random.default_rng(0).random(size) < share).astype(np.uint8)
    np.testing.assert_array_equal(to_image(clean(salt, CleaningConfig(open_px=1, fill_holes=False)), size), salt)


@given(random_masks)
def test_all_eight_versions_of_a_mask_come_into_one_pose(mask: np.ndarray) -> None:
    config = CleaningConfig(open_px=1, close_px=1, fill_holes=False)
    first, *others = (clean(version, config) for version in versions(mask))
    for crop in others:
        if first is None or crop is None:
            assert first is crop is None
        else:
            np.testing.assert_array_equal(crop.oriented(crop.pixels), first.oriented(first.pixels))


@pytest.mark.parametrize(
    "text",
    [
        "###\n#..\n#..",  # symmetric about its diagonal
        "#..#\n####\n#..#",  # symmetric about both axes
        "##..\n.##.\n..##",  # symmetric under a half turn only
        "#.#\n.#.\n#.#",
    ],
)
def test_symmetric_masks_come_into_one_pose(text: str) -> None:
    mask = mask_from_text(text)
    views = set()
    for version in versions(mask):
        crop = clean(version, CleaningConfig(open_px=1, close_px=1, fill_holes=False))
        assert crop is not None
        views.add((crop.oriented(crop.pixels).shape, crop.oriented(crop.pixels).tobytes()))
    assert len(views) == 1


@given(random_masks)
def test_posed_pixels_find_back_to_the_image(mask: np.ndarray) -> None:
    crop = clean(mask, CleaningConfig(open_px=1, close_px=1, fill_holes=False))
    if crop is None:
        return
    oriented_rc = np.argwhere(crop.oriented(crop.pixels))
    x, y = crop.to_image(oriented_rc[:, ::-1].astype(np.float64)).astype(int).T
    image = np.zeros_like(mask)
    image[y, x] = 1
    np.testing.assert_array_equal(image, mask)


SIZES = [(240, 320), (720, 1280), pytest.param((2160, 3840), marks=pytest.mark.large)]


@pytest.mark.parametrize("size", SIZES)
@pytest.mark.parametrize("width", [1.0, 1.5, 2.0, 2.5, 3.0])
def test_a_thin_cable_stays_in_one_piece_through_salt(width: float, size: tuple[int, int]) -> None:
    for seed in range(2):
        curve = random_curve(np.random.default_rng(seed), 250.0, (240, 320), min_radius_px=15.0)
        mask = draw_tube_mask(curve, width, size)
        cleaned = to_image(clean(mask, CleaningConfig()), size)
        assert cv2.connectedComponents(cleaned)[0] == 2
        assert (cleaned[mask] != 0).mean() > 0.97
        salted = mask | (np.random.default_rng(seed).random(size) < 0.003)
        cleaned = to_image(clean(salted, CleaningConfig()), size)
        assert (cleaned[mask] != 0).mean() > 0.95
        assert cv2.connectedComponents(cleaned)[0] == 2


@pytest.mark.parametrize("angle", np.linspace(0.0, np.pi / 2, 13))
@pytest.mark.parametrize("width", [1, 2])
def test_a_thin_line_at_any_angle_is_kept(width: int, angle: float) -> None:
    mask = np.zeros((200, 200), np.uint8)
    end = np.rint(100 + 80 * np.array([np.cos(angle), np.sin(angle)])).astype(int)
    cv2.line(mask, (100, 100), (int(end[0]), int(end[1])), 1, width)
    cleaned = to_image(clean(mask, CleaningConfig()), mask.shape)
    assert cv2.connectedComponents(cleaned)[0] == 2
    assert cleaned[mask != 0].mean() > 0.85  # such lines are 3 px wide in places, and lose corners there


@pytest.mark.parametrize("noise", [NOISY, Degradation(salt_and_pepper=0.01, jitter_px=1.0)])
@pytest.mark.parametrize("width", [8.0, 12.0, 20.0])
def test_nothing_of_the_noise_comes_back(width: float, noise: Degradation) -> None:
    curve = random_curve(np.random.default_rng(3), 500.0, (480, 640), min_radius_px=2 * width)
    mask = noise.apply(draw_tube_mask(curve, width, (480, 640)), [curve], (0,))
    with_pieces, without = (to_image(clean(mask, CleaningConfig(thin_px=n)), mask.shape) for n in (20, 0))
    assert cv2.connectedComponents(with_pieces)[0] == cv2.connectedComponents(without)[0]
    assert with_pieces.sum() - without.sum() < 0.01 * without.sum()


def test_a_thin_cable_that_leaves_the_image_is_kept_to_the_border() -> None:
    mask = np.zeros((60, 80), bool)
    mask[30:32] = True
    np.testing.assert_array_equal(to_image(clean(mask, CleaningConfig()), mask.shape), mask)


def coded_cable(width: int, seed: int) -> np.ndarray:
    """A mask by colour of a saturated cable on dark ground, in a frame of H.264."""
    rng = np.random.default_rng(seed)
    image = np.full((160, 480, 3), 30, np.uint8)
    points = np.array([[30, 80], [240, 80], [450, 80]]) + rng.uniform(-20, 20, (3, 2))
    hue = int(rng.integers(180))
    colour = cv2.cvtColor(np.array([[[hue, 230, 220]]], np.uint8), cv2.COLOR_HSV2BGR)[0, 0].tolist()
    cv2.polylines(image, [np.rint(16 * points).astype(np.int32)], False, colour, width, cv2.LINE_AA, 4)
    coded = io.BytesIO()
    with av.open(coded, "w", format="matroska") as output:
        stream = output.add_stream("libx264", rate=Fraction(20))
        stream.width, stream.height, stream.pix_fmt = 480, 160, "yuv420p"
        frame = av.VideoFrame.from_ndarray(image, format="bgr24")
        output.mux([*stream.encode(frame), *stream.encode()])
    coded.seek(0)
    with av.open(coded) as source:
        decoded = next(source.decode(video=0)).to_ndarray(format="bgr24")
    h, s, v = np.moveaxis(cv2.cvtColor(decoded, cv2.COLOR_BGR2HSV).astype(int), 2, 0)
    return (np.minimum(abs(h - hue), 180 - abs(h - hue)) <= 8) & (s >= 150) & (v >= 60)


@pytest.mark.large
@pytest.mark.parametrize("width", [8, 12, 20, 34, 50])
def test_the_fringe_of_a_coded_edge_does_not_come_back(width: int) -> None:
    for seed in range(8):
        mask = coded_cable(width, seed)
        assert len(Pipeline(Config()).detect(Frame(mask=mask))) == 1


def beside(angle: float, first: float, thickness: int, stop: float = 60.0, start: float = -60.0) -> np.ndarray:
    """A thread along a cable of 20 px, both at an angle; it begins so many pixels away from the edge."""
    mask = np.zeros((300, 300), np.uint8)
    along, across = np.array([np.cos(angle), np.sin(angle)]), np.array([-np.sin(angle), np.cos(angle)])
    for s, t, offset, width in ((-120.0, 120.0, 0.0, 20), (start, stop, 10.0 + first + (thickness - 1) / 2, thickness)):
        ends = 150 + np.array([s * along, t * along]) + offset * across
        one, other = (16 * ends).astype(int).tolist()
        cv2.line(mask, one, other, 1, width, cv2.LINE_8, 4)
    return mask


@pytest.mark.parametrize("angle", np.linspace(0.0, np.pi, 9)[:-1])
def test_a_thread_in_the_edge_of_a_thick_cable_does_not_come_back(angle: float) -> None:
    for first, thickness, reach in ((1.5, 1, 100.0), (2.0, 1, 30.0), (2.5, 2, 15.0), (4.0, 2, 15.0)):
        mask = beside(angle, first, thickness, reach, -reach)
        with_pieces, without = (to_image(clean(mask, CleaningConfig(thin_px=n)), mask.shape) for n in (20, 0))
        assert int(with_pieces.sum()) - int(without.sum()) < 20


@pytest.mark.parametrize("angle", np.linspace(0.0, np.pi, 9)[:-1])
def test_a_wire_beside_a_thick_cable_comes_back(angle: float) -> None:
    for first, reach in ((6.0, 100.0), (14.0, 30.0)):
        mask = beside(angle, first, 2, reach, -reach)
        wire = mask & ~beside(angle, first, 2, 0.0, 0.0)
        cleaned = to_image(clean(mask, CleaningConfig()), mask.shape)
        assert cleaned[wire != 0].mean() > 0.9


@pytest.mark.parametrize("angle", np.deg2rad([15.0, 30.0, 60.0, 90.0, 110.0, 155.0]))
@pytest.mark.parametrize("thickness", [1, 2])
def test_a_thin_cable_that_crosses_a_thick_one_comes_back_up_to_it(angle: float, thickness: int) -> None:
    thick = np.zeros((300, 500), np.uint8)
    thick[140:160, 10:490] = 1
    mask = thick.copy()
    way = 130 / np.sin(angle) * np.array([np.cos(angle), np.sin(angle)])
    one, other = np.rint(np.array([250, 150]) + np.stack((-way, way))).astype(int).tolist()
    cv2.line(mask, one, other, 1, thickness)
    cleaned = to_image(clean(mask, CleaningConfig()), mask.shape)
    assert cv2.connectedComponents(cleaned)[0] == 2
    assert cleaned[(mask & ~thick) != 0].mean() > 0.9


@pytest.mark.parametrize("angle", [0.05, 0.2, 0.7])
def test_the_dashes_of_a_thin_cable_come_back_through_salt(angle: float) -> None:
    mask = (np.random.default_rng(0).random((224, 224)) < 0.002).astype(np.uint8)
    dashes = np.zeros_like(mask)
    along = np.array([np.cos(angle), np.sin(angle)])
    for k in range(11):
        ends = np.rint([15 + 17 * k * along, 15 + (17 * k + 9) * along]).astype(int).tolist()
        cv2.line(dashes, ends[0], ends[1], 1)
    cleaned = to_image(clean(mask | dashes, CleaningConfig()), mask.shape)
    assert cleaned[dashes != 0].mean() > 0.9
    assert int(cleaned.sum()) < 1.05 * int(dashes.sum())


@pytest.mark.parametrize("open_px", [3, 5, 7])
@pytest.mark.parametrize("close_px", [1, 3])
def test_a_polygon_s_edge_takes_nothing_from_what_it_cuts(open_px, close_px):
    size, corners = (90, 140), ((70, 3), (135, 40), (70, 86), (5, 40))
    region = Region(corners, size)
    mask = np.zeros(size, np.uint8)
    mask[30:39, :] = 1  # cut at a slant on both sides
    mask[:, 60:72] = 1  # cut at corners
    within = region.clear_outside(region.cut(mask))
    crop = clean(within, CleaningConfig(open_px=open_px, close_px=close_px, thin_px=0), region)
    (x, y), (h, w) = crop.origin, crop.size
    cleaned = np.zeros(region.size, bool)
    cleaned[y : y + h, x : x + w] = crop.pixels[1 : h + 1, 1 : w + 1]
    assert not (within & ~cleaned).any()
    assert not (cleaned & (region.inside == 0)).any()
    assert close_px > 1 or np.array_equal(cleaned, within)
    assert np.array_equal(crop.outline, region.outline)


@pytest.mark.parametrize("branched", [False, True])
def test_a_notch_of_a_polygon_within_a_cable_is_not_filled(branched):
    size, corners = (90, 140), ((0, 0), (139, 0), (139, 43), (70, 43), (70, 47), (139, 47), (139, 89), (0, 89))
    region = Region(corners, size)
    mask = np.zeros(size, np.uint8)
    mask[35:56, 10:140] = 1
    within = region.clear_outside(region.cut(mask))
    assert (within == 0)[45, 80:].all()
    crop = clean(within, CleaningConfig(), region, branched=branched)
    (x, y), (h, w) = crop.origin, crop.size
    cleaned = np.zeros(region.size, bool)
    cleaned[y : y + h, x : x + w] = crop.pixels[1 : h + 1, 1 : w + 1]
    assert not (cleaned & (region.inside == 0)).any()
