"""Pixels that differ from the same place without cables."""

import cv2
import numpy as np
import pytest
from uneven_pictures import SIZE, iou, line, lit, picture

import dloftbs
from dloftbs.errors import ConfigError, InputError
from dloftbs.segmentation import BackgroundSegmenter, median_background
from dloftbs.segmentation.background_difference import read_background


def textured(seed=5):
    """Return a ground (H, W, 1) with grain in two directions."""
    rng = np.random.default_rng(seed)
    grain = cv2.GaussianBlur(rng.normal(0.0, 60.0, SIZE), (0, 0), 3.0) + cv2.GaussianBlur(
        rng.normal(0.0, 60.0, SIZE), (0, 0), 1.0
    )
    return (120.0 + grain)[..., None]


def laid(truth, level, **light):
    """Return an image of an opaque cable of a level on the texture."""
    return picture(truth, textured(), level - textured(), **light)


EMPTY = picture(np.zeros(SIZE), textured(), 0, noise=0.0)


@pytest.mark.parametrize("gain", [1.0, 0.8, 1.15])
@pytest.mark.parametrize(("level", "noise"), [(30, 2.0), (220, 2.0), (30, 6.0), (60, 1.0)])
def test_a_cable_on_a_texture_is_found_whatever_the_exposure(level, noise, gain):
    truth = line(6)
    image = laid(truth, level, light=gain * np.ones(SIZE), noise=noise)
    mask = BackgroundSegmenter(EMPTY)(image)
    assert mask.dtype == np.uint8
    assert set(np.unique(mask)) == {0, 1}
    assert iou(mask, truth) > 0.85


@pytest.mark.parametrize("width", [3, 8])
@pytest.mark.parametrize("gain", [0.7, 0.9, 1.1, 1.3])
def test_highlights_that_saturate_in_one_exposure_alone_are_no_cable(gain, width):
    y, x = np.mgrid[: SIZE[0], : SIZE[1]]
    spot = np.exp(-((x - 0.5 * SIZE[1]) ** 2 + (y - 0.25 * SIZE[0]) ** 2) / (2.0 * (0.15 * SIZE[0]) ** 2))
    truth = line(width)
    lit_place = (150.0 + 130.0 * spot)[..., None]
    background = picture(np.zeros(SIZE), lit_place, 0, noise=0.0)
    assert (background == 255).any()
    mask = BackgroundSegmenter(background)(picture(truth, lit_place, 40 - lit_place, light=gain * np.ones(SIZE)))
    assert iou(mask, truth) > 0.8


@pytest.mark.parametrize("level", [30, 220])
def test_the_shadow_beside_a_cable_is_none_of_it(level):
    truth = line(6)
    beside = cv2.GaussianBlur(np.roll(truth, 7, axis=0).astype(np.float64), (0, 0), 2.0)
    image = laid(truth, level, light=1.0 - 0.3 * beside * (truth == 0))
    assert iou(BackgroundSegmenter(EMPTY)(image), truth) > 0.8
    alone = picture(np.zeros(SIZE), textured(), 0, light=1.0 - 0.3 * beside)
    assert iou(BackgroundSegmenter(EMPTY)(alone), beside > 0.5) > 0.4  # which may be a dim worm


def test_a_cable_over_grounds_of_several_brightnesses_is_whole():
    grounds = np.where(np.indices(SIZE)[1] // 40 % 2, 90.0, 190.0)[..., None]
    truth = line(8)
    image = picture(truth, grounds, 20 - grounds)
    mask = BackgroundSegmenter(picture(np.zeros(SIZE), grounds, 0, noise=0.0))(image)
    assert mask[truth > 0].mean() > 0.85


def test_a_change_of_one_channel_is_enough():
    truth = line(6)
    image = picture(truth, textured(), 0)
    image[..., 0] = laid(truth, 30)[..., 0]
    assert iou(BackgroundSegmenter(EMPTY)(image), truth) > 0.85


@pytest.mark.parametrize("noise", [0.0, 2.0, 8.0])
@pytest.mark.parametrize("gain", [0.7, 1.0, 1.2])
def test_the_empty_place_is_empty_in_noise_and_other_light(gain, noise):
    image = picture(np.zeros(SIZE), textured(), 0, light=gain * np.ones(SIZE), noise=noise, seed=3)
    assert BackgroundSegmenter(EMPTY)(image).sum() == 0


def test_a_camera_that_trembles_by_half_a_pixel_sees_no_cables():
    shift = np.array([[1.0, 0.0, 0.5], [0.0, 1.0, -0.5]])
    moved = cv2.warpAffine(EMPTY, shift, SIZE[::-1], borderMode=cv2.BORDER_REPLICATE)
    assert BackgroundSegmenter(EMPTY)(moved).mean() < 0.001


def test_a_background_of_another_place_says_nothing_and_warns_once(caplog):
    other = picture(np.zeros(SIZE), textured(6), 0)
    segmenter = BackgroundSegmenter(EMPTY)
    assert segmenter(EMPTY).sum() == 0
    assert caplog.messages == []
    assert segmenter(other).all()
    assert segmenter(other).all()
    assert [message.partition(":")[0] for message in caplog.messages] == [
        "segmentation.background shows another place than the frames, or another light"
    ]
    result = dloftbs.detect(other, segmenter=BackgroundSegmenter(EMPTY))
    assert len(result) == 0
    assert "100 % of the mask is set" in result.reason


def test_a_contrast_of_the_user_takes_the_place_of_the_noise():
    image = laid(line(6), 60)
    assert BackgroundSegmenter(EMPTY, contrast=10)(image).sum() > 1000
    assert BackgroundSegmenter(EMPTY, contrast=130)(image).sum() == 0
    with pytest.raises(ConfigError, match="contrast must be"):
        BackgroundSegmenter(EMPTY, contrast=0)


def clip(number, light=0.0):
    """Yield frames in which a cable moves through the image."""
    for index in range(number):
        truth = np.roll(line(6), 7 * index, axis=0)
        yield laid(truth, 40, light=(1.0 + light * np.sin(index)) * np.ones(SIZE), seed=index)


@pytest.mark.large
@pytest.mark.parametrize("light", [0.0, 0.2])
@pytest.mark.parametrize("number", [24, 25, 130])
def test_the_median_of_a_clip_is_the_place_without_the_cable(number, light):
    background = median_background(clip(number, light))
    frame = next(clip(1))
    assert background.dtype == np.uint8
    assert iou(BackgroundSegmenter(background)(frame), line(6)) > 0.85


@pytest.mark.large
def test_the_frames_of_a_median_are_spread_over_the_whole_clip():
    """The cable rests over the first third of the clip."""
    frames = [*[next(clip(1))] * 60, *clip(120)]
    assert iou(BackgroundSegmenter(median_background(frames))(frames[0]), line(6)) > 0.85


def test_a_median_of_one_frame_is_the_frame_and_of_two_one_of_them():
    assert np.array_equal(median_background([EMPTY]), EMPTY)
    assert np.array_equal(median_background([dloftbs.Frame(image=EMPTY)] * 2), EMPTY)


@pytest.mark.parametrize(
    ("frames", "message"),
    [([], "there are none"), ([EMPTY, EMPTY[:-1]], "must have one size"), ([np.zeros(SIZE, np.uint8)], "is a mask")],
)
def test_frames_that_make_no_background_are_refused(frames, message):
    with pytest.raises(InputError, match=message):
        median_background(frames)


def test_frames_of_another_size_are_refused_with_both_sizes():
    with pytest.raises(InputError, match=r"segmentation.background is 320 x 240 px, the frame 319 x 240"):
        BackgroundSegmenter(EMPTY)(EMPTY[:, 1:])


@pytest.mark.parametrize("name", ["empty.png", "empty.npy", "grey.png", "deep.png"])
def test_a_background_is_read_from_a_picture_or_an_array(tmp_path, name):
    path = tmp_path / name
    if name == "empty.npy":
        np.save(path, EMPTY)
    else:
        pixels = {"grey.png": EMPTY[..., 0], "deep.png": EMPTY.astype(np.uint16) * 257}.get(name, EMPTY)
        cv2.imwrite(str(path), pixels)
    mask = BackgroundSegmenter(read_background(str(path)))(laid(line(6), 40))
    assert iou(mask, line(6)) > 0.85


@pytest.mark.parametrize(
    ("name", "data", "message"),
    [
        ("missing.png", None, "cannot read .*missing.png.*No such file"),
        ("missing.npy", None, "cannot read .*missing.npy"),
        ("text.png", b"text", "is no picture; make one of a clip by `dloftbs background"),
        ("empty.png", b"", "is no picture"),
        ("text.npy", b"text", "cannot read .*text.npy"),
    ],
)
def test_a_file_that_is_no_background_is_refused_by_name(tmp_path, name, data, message):
    if data is not None:
        (tmp_path / name).write_bytes(data)
    with pytest.raises(ConfigError, match=message):
        read_background(str(tmp_path / name))


def test_an_array_of_other_numbers_is_refused(tmp_path):
    np.save(tmp_path / "a.npy", np.zeros((5, 5, 3)))
    with pytest.raises(ConfigError, match="image must have shape"):
        read_background(str(tmp_path / "a.npy"))


def test_a_background_without_pixels_is_refused():
    with pytest.raises(InputError, match="must have pixels"):
        BackgroundSegmenter(np.zeros((0, 5, 3), np.uint8))


def test_the_background_is_kept_as_it_was():
    background = EMPTY.copy()
    segmenter = BackgroundSegmenter(background)
    background[:] = 0
    assert segmenter(EMPTY).sum() == 0


def test_uneven_light_on_the_place_is_no_cable():
    still = picture(np.zeros(SIZE), textured(), 0, light=lit(), noise=0.0)
    image = laid(line(6), 40, light=lit())
    assert iou(BackgroundSegmenter(still)(image), line(6)) > 0.85
