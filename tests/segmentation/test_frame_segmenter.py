"""Ways to a mask that are chosen together."""

import numpy as np
import pytest

import dloftbs
from dloftbs.config import BackgroundConfig, Config, HsvRange, LocalConfig, PlaneConfig, SegmentationConfig
from dloftbs.errors import ConfigError, InputError
from dloftbs.segmentation import ColourModel, Stroke, make_segmenter, suggest_mask

RED, GREEN = (30, 20, 210), (40, 190, 40)
CAMERA = dloftbs.PinholeCamera(300.0, 300.0, 99.5, 49.5)


def picture():
    image = np.full((100, 200, 3), (120, 130, 140), np.uint8)
    image[28:33, 20:180], image[68:73, 20:180] = RED, GREEN
    return image


def raised(rows):
    depth = np.full((100, 200), 0.6, np.float32)
    depth[rows, 20:180] = 0.59
    return depth


def test_where_nothing_is_configured_there_is_no_segmenter():
    assert make_segmenter(SegmentationConfig()) is None
    assert not SegmentationConfig().is_given


def test_ranges_and_a_colour_find_what_either_finds():
    image = picture()
    colour = ColourModel.fit(image, [Stroke(points=[(30, 70), (150, 70)], radius_px=1)]).to_config()
    mask = make_segmenter(SegmentationConfig(hsv=(HsvRange.parse("170:10"),), colour=colour))(
        dloftbs.Frame(image=image)
    )
    assert mask[30, 100]
    assert mask[70, 100]
    assert np.count_nonzero(mask) == 2 * 5 * 160


@pytest.mark.parametrize(("join", "rows"), [("and", {30}), ("or", {30, 50, 70})])
def test_a_plane_is_joined_with_a_colour(join, rows):
    plane = PlaneConfig(join=join, height_m=0.004)
    both = (HsvRange.parse("170:10"), HsvRange.parse("50:70"))
    depth = np.minimum(raised(slice(28, 33)), raised(slice(48, 53)))
    frame = dloftbs.Frame(image=picture(), depth=depth, camera=CAMERA)
    mask = make_segmenter(SegmentationConfig(hsv=both, plane=plane))(frame)
    assert {row for row in (30, 50, 70) if mask[row, 100]} == rows


@pytest.mark.parametrize("beside", [{}, {"depth": raised(slice(28, 33))}])
def test_a_plane_without_depth_or_camera_is_refused(beside):
    pipeline = dloftbs.Pipeline(Config(segmentation=SegmentationConfig(plane=PlaneConfig())))
    with pytest.raises(InputError, match="needs frames with depth and a camera"):
        pipeline.process(dloftbs.Frame(image=picture(), **beside))


def lines(directory):
    """Return a frame with a red, a green and a black line, and the file of its background, which has the green one."""
    image = picture()
    image[48:53, 20:180], image[68:73, 20:180] = (20, 20, 20), (20, 110, 20)
    background = image.copy()
    background[28:33], background[48:53] = background[0], background[0]
    np.save(directory / "background.npy", background)
    return dloftbs.Frame(image=image), str(directory / "background.npy")


@pytest.mark.parametrize(
    ("local", "background", "rows"),
    [
        ("and", None, {30, 70}),
        ("or", None, {30, 50, 70}),
        (None, "and", {30}),
        (None, "or", {30, 50, 70}),
        ("or", "and", {30, 50}),
        ("and", "or", {30, 50, 70}),
        ("and", "and", {30}),
    ],
)
def test_surroundings_and_background_are_joined_with_a_colour_as_the_plane_is(tmp_path, local, background, rows):
    frame, file = lines(tmp_path)
    section = SegmentationConfig(
        hsv=(HsvRange.parse("170:10"), HsvRange.parse("50:70")),
        local=local and LocalConfig(tone="darker", join=local),
        background=background and BackgroundConfig(file=file, join=background),
    )
    mask = make_segmenter(section)(frame)
    assert {row for row in (10, 30, 50, 70, 90) if mask[row, 100]} == rows


def test_surroundings_and_background_say_what_is_cable_without_a_colour(tmp_path):
    frame, file = lines(tmp_path)
    for section, rows in (
        (SegmentationConfig(local="darker"), {30, 50, 70}),
        (SegmentationConfig(local="brighter"), set()),
        (SegmentationConfig(background=file), {30, 50}),
        (SegmentationConfig(local="darker", background=file), {30, 50}),
    ):
        assert section.is_given
        assert section.needs_image
        mask = make_segmenter(section)(frame)
        assert {row for row in (10, 30, 50, 70, 90) if mask[row, 100]} == rows


def test_a_plane_is_joined_with_the_surroundings():
    frame = dloftbs.Frame(image=picture(), depth=raised(slice(28, 33)), camera=CAMERA)
    mask = make_segmenter(SegmentationConfig(local="darker", plane=PlaneConfig(height_m=0.004)))(frame)
    assert mask[30, 100]
    assert not mask[70, 100]


@pytest.mark.parametrize("name", ["local", "background"])
def test_frames_without_an_image_are_refused_where_one_is_needed(tmp_path, name):
    _, file = lines(tmp_path)
    segmenter = make_segmenter(SegmentationConfig(**{name: "darker" if name == "local" else file}))
    with pytest.raises(InputError, match=f"segmentation.{name} needs frames with an image"):
        segmenter(dloftbs.Frame(mask=np.zeros((100, 200), np.uint8)))


def test_a_missing_background_is_an_error_at_once():
    with pytest.raises(ConfigError, match=r"cannot read '.*missing.png'"):
        dloftbs.Pipeline({"segmentation": {"background": "missing.png"}})


def test_frames_of_another_size_than_the_background_are_refused(tmp_path):
    frame, file = lines(tmp_path)
    with pytest.raises(InputError, match="make it anew from frames of this size"):
        dloftbs.detect(frame.image[1:], config={"segmentation": {"background": file}})


def test_settings_of_a_section_within_one_can_be_set_alone():
    config = Config().replace({"segmentation.plane.height_m": 0.01}).replace({"segmentation.plane.join": "or"})
    assert config.segmentation.plane == PlaneConfig(height_m=0.01, join="or")


def test_another_colour_takes_the_place_of_the_learned_one_alone():
    colour = ColourModel.fit(picture(), [Stroke(points=[(30, 70)])]).to_config()
    section = SegmentationConfig(colour=colour, plane=PlaneConfig()).with_hsv("170:10")
    assert section == SegmentationConfig(hsv=(HsvRange.parse("170:10"),), plane=PlaneConfig())


def test_an_empty_mask_of_a_segmentation_is_said_to_be_one():
    result = dloftbs.detect(picture(), hsv="110:120")
    assert result.reason == (
        "the mask is empty: the segmentation finds no cable in the image "
        "(arrays are BGR: turn an RGB one by image[..., ::-1])"
    )


def test_a_segmenter_that_returns_nothing_is_refused():
    with pytest.raises(InputError, match="the segmenter returned None"):
        dloftbs.detect(picture(), segmenter=lambda image: None)


@pytest.mark.parametrize(
    ("mask", "said"),
    [
        (np.zeros((2, 100, 200), np.float32), r"got \(2, 100, 200\); return the channel of the cable alone"),
        (np.zeros((1, 2, 100, 200), np.float32), r"got \(1, 2, 100, 200\); return the channel"),
        (np.zeros((100, 200, 3), np.uint8), r"got \(100, 200, 3\); return the channel"),
        (np.zeros((200, 100), np.uint8), r"got \(200, 100\); rows come first: mask\.T"),
        (np.zeros((50, 100), np.float32), r"got \(50, 100\); resize it: cv2\.resize\(mask, \(200, 100\)\)"),
        (np.zeros((50, 100), bool), r"resize it: cv2\.resize\(mask\.astype\(np\.uint8\), .*INTER_NEAREST"),
    ],
)
def test_a_mask_of_another_shape_is_refused_with_what_mends_it(mask, said):
    with pytest.raises(InputError, match=said):
        dloftbs.detect(picture(), segmenter=lambda image: mask)


def test_the_first_guess_is_what_is_long_and_differs():
    image = picture()
    image[40:60, 90:110] = (255, 255, 255)  # a square
    mask = suggest_mask(image)
    assert mask.dtype == np.uint8
    assert mask[30, 100] == mask[70, 100] == 1
    assert mask[50, 100] == mask[10, 10] == 0
    assert not suggest_mask(np.zeros((0, 5, 3), np.uint8)).any()
