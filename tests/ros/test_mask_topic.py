"""Masks that have a topic of their own go to the images of their moments, however late they were recorded."""

from __future__ import annotations

import cv2
import numpy as np
import pytest
from cli.cli_inputs import run
from ros import bag_examples as bags

from dloftbs import sources
from dloftbs.errors import InputError, SourceError
from dloftbs.ros import BagSource, FrameMaker
from dloftbs.ros.bag_file import Topic
from dloftbs.ros.topic_choice import COMPRESSED_TYPE, IMAGE_TYPE, choose_topics

MASKS = "/segmenter/mask"
COUNT = 8


def masks(indices, late_ns=40_000_000, shift_ns=0, pixels=None):
    """Return masks with the stamps of their images, recorded later."""
    found = []
    for i in indices:
        content = bags.mask_of(i) if pixels is None else pixels
        at = bags.stamp_of(i) + shift_ns
        found.append((MASKS, bags.stamp_of(i) + late_ns, bags.raw_image(content, "mono8", at)))
    return found


def written(folder, found, **options):
    given = sorted([*bags.entries(COUNT, **options), *found], key=lambda entry: entry[1])
    return bags.write_ros2(folder / "run", given)


def read(path, **options):
    with BagSource(path, mask_topic=MASKS, **options) as source:
        return list(source), source


@pytest.mark.parametrize("late_ns", [3_000_000, 900_000_000])
@pytest.mark.parametrize("depth", [False, True])
def test_each_image_has_its_mask(tmp_path, caplog, late_ns, depth):
    frames, source = read(written(tmp_path, masks(range(COUNT), late_ns), depth=depth))

    assert [frame.index for frame in frames] == list(range(COUNT))
    for frame in frames:
        assert (frame.image == bags.photo_of(frame.index)).all()
        assert (frame.mask == bags.mask_of(frame.index)).all()
        assert frame.camera is not None
        assert (frame.depth is not None) == depth
    assert source.skipped == 0
    assert not caplog.records


@pytest.mark.parametrize(("shift_ns", "count"), [(900_000, COUNT), (-900_000, COUNT), (16_000_000, 0)])
def test_a_mask_has_the_stamp_of_its_image_but_for_what_rounding_takes(tmp_path, shift_ns, count):
    frames, _ = read(written(tmp_path, masks(range(COUNT), shift_ns=shift_ns)))
    assert len(frames) == count


def images_and_masks(headers_ns, late_ns):
    """Return images, recorded every .6 s, and masks with their stamps."""
    given = []
    for i, (header_ns, late) in enumerate(zip(headers_ns, late_ns, strict=True)):
        at = bags.START_NS + i * 600_000_000
        given.append((bags.COLOUR_TOPIC, at, bags.raw_image(bags.photo_of(i), "bgr8", header_ns)))
        given.append((MASKS, at + late, bags.raw_image(bags.mask_of(i), "mono8", header_ns)))
    return given


@pytest.mark.parametrize(
    "headers_ns", [[0] * COUNT, [bags.START_NS + (i % 4) * 600_000_000 for i in range(COUNT)]], ids=["none", "a loop"]
)
def test_masks_are_found_where_headers_have_no_times_or_begin_anew(tmp_path, headers_ns):
    late_ns = [3_000_000, 18_000_000, 7_000_000, 12_000_000] * 2
    frames, _ = read(bags.write_ros2(tmp_path / "run", images_and_masks(headers_ns, late_ns)))
    assert [frame.index for frame in frames] == list(range(COUNT))
    assert all((frame.mask == bags.mask_of(frame.index)).all() for frame in frames)


def test_frames_carry_their_own_images_however_late_masks_are(tmp_path):
    frames, _ = read(written(tmp_path, masks(range(COUNT), 900_000_000)), keep_messages=True)
    images = [[raw.stamp_ns for raw in frame.recorded if raw.topic == bags.COLOUR_TOPIC] for frame in frames]
    assert images == [[bags.stamp_of(i) + 2_000_000] for i in range(COUNT)]


def test_a_grey_mask_is_read_as_a_probability_and_one_of_two_values_is_binary(tmp_path):
    grey = np.maximum(cv2.GaussianBlur(np.where(bags.mask_of(0), np.uint8(255), np.uint8(0)), (0, 0), 2), 5)
    ((soft,), _), ((hard,), _) = (
        read(written(tmp_path / name, masks([0], pixels=pixels)))
        for name, pixels in (("soft", grey), ("hard", np.minimum(bags.mask_of(0), 1)))
    )
    assert np.array_equal(soft.is_cable, grey >= 128)
    assert np.array_equal(hard.is_cable, bags.mask_of(0) > 0)


def test_images_without_a_mask_are_left_out(tmp_path, caplog):
    frames, source = read(written(tmp_path, masks(range(1, COUNT, 3))))

    assert [frame.index for frame in frames] == [1, 4, 7]
    assert (source.skipped, source.length) == (0, None)  # a segmenter may be slower than the camera
    (record,) = caplog.records
    assert record.getMessage().endswith(f": left out 5 images without a mask of their time on {MASKS}")


def test_masks_of_other_times_are_said(tmp_path, caplog):
    frames, _ = read(written(tmp_path, masks(range(COUNT), shift_ns=200_000_000)[-1:]))

    assert frames == []
    assert f"frames go without a mask: {MASKS} is at least 0.2 s away from every image, 0.001 s at most" in caplog.text
    caplog.clear()
    broken = [(MASKS, bags.stamp_of(0), bags.raw_image(bags.mask_of(0), "nonsense", bags.stamp_of(0)))]
    frames, source = read(written(tmp_path / "other", broken))
    assert frames == []
    assert source.skipped == 1
    assert f"left out {COUNT - 1} images without a mask" in caplog.text
    assert "its mask: unknown encoding 'nonsense'" in caplog.text


def test_a_mask_of_another_size_is_an_error(tmp_path):
    path = written(tmp_path, masks(range(COUNT), pixels=np.ones((60, 80), np.uint8)))
    with pytest.raises(InputError, match=r"mask must have the frame's size \(120, 160\)"):
        read(path)


def test_a_colour_picture_is_no_mask(tmp_path, caplog):
    colour = [(MASKS, bags.stamp_of(0), bags.raw_image(bags.photo_of(0), "bgr8", bags.stamp_of(0)))]
    assert read(written(tmp_path, colour))[0] == []
    assert "its mask must have one channel, got (120, 160, 3)" in caplog.text


def test_a_grey_image_with_a_mask_is_an_image(tmp_path):
    grey = [("/cam/image", bags.stamp_of(0), bags.raw_image(bags.photo_of(0)[..., 0], "mono8", bags.stamp_of(0)))]
    path = bags.write_ros2(tmp_path / "run", [*grey, *masks([0])])
    ((frame,), _) = read(path)
    assert (frame.image == bags.photo_of(0)[..., :1]).all()
    assert (frame.mask == bags.mask_of(0)).all()


def test_masks_alone_are_read_as_images_are(tmp_path):
    path = bags.write_ros2(tmp_path / "run", masks(range(3)))
    for kind in ("auto", "mask"):
        with sources.open(path, topic=MASKS, kind=kind) as source:
            assert [(frame.mask == bags.mask_of(frame.index)).all() for frame in source] == [True] * 3


def test_the_topic_of_the_masks_is_none_of_images_nor_of_depth():
    image, mask = Topic("/a/image", IMAGE_TYPE, 9), Topic("/b/depth_mask", IMAGE_TYPE, 9)
    packed = Topic("/b/depth_mask/compressed", COMPRESSED_TYPE, 9)
    found = choose_topics("run", (image, mask, packed), mask_topic="b/depth_mask")
    assert (found.image, found.mask, found.depth) == (image, mask, None)
    assert found.remarks == ()
    assert choose_topics("run", (image, packed), mask_topic="/b/depth_mask").mask == packed


@pytest.mark.parametrize(
    ("named", "said"),
    [
        ({"mask_topic": "/m"}, "--mask-topic /m is no topic of Image or CompressedImage; there is /a/image"),
        ({"mask_topic": "/a/image"}, "holds no topic of colour images or masks"),
        ({"topic": "/a/image", "mask_topic": "/a/image"}, "is the topic of the images; --kind mask reads it alone"),
    ],
)
def test_names_that_cannot_be_masks(named, said):
    with pytest.raises(SourceError, match=said):
        choose_topics("run", (Topic("/a/image", IMAGE_TYPE, 9),), **named)


def test_masks_come_from_one_place(tmp_path):
    path = written(tmp_path, masks(range(COUNT)))
    with pytest.raises(InputError, match="masks and mask_topic are two sources of masks"):
        sources.open(path, mask_topic=MASKS, masks=tmp_path)
    with pytest.raises(InputError, match="kind must be 'image' where masks have a topic of their own, got 'mask'"):
        sources.open(path, mask_topic=MASKS, kind="mask")
    with pytest.raises(InputError, match="mask_topic: only recordings of ROS have topics"):
        sources.open(np.zeros((1, 9, 9), bool), mask_topic=MASKS)
    with pytest.raises(InputError, match="mask_topic must be text"):
        BagSource(path, mask_topic=3)


def test_a_maker_takes_two_messages():
    image, mask = bags.raw_image(bags.photo_of(0), "bgr8"), bags.raw_image(bags.mask_of(0), "mono8")
    maker = FrameMaker("/image", kind="mask")
    frame = maker.make(image, maker.pixels(image, mask))
    assert (frame.image == bags.photo_of(0)).all()
    assert (frame.mask == bags.mask_of(0)).all()


def test_the_values_of_a_mask_are_what_is_said_of_them(tmp_path):
    soft = np.full(bags.SIZE, 100, np.uint8)
    jpeg = bags.compressed(bags.encoded(soft, ".jpg"), "jpeg", bags.stamp_of(0))
    path = written(tmp_path, [(MASKS, bags.stamp_of(0), jpeg)])
    with sources.open(path, mask_topic=MASKS, mask_is="probability") as source:
        (frame,) = source
    assert frame.mask_is == "probability"
    assert (frame.mask == 100).all()
    (frame,), _ = read(path)
    assert not frame.mask.any()
    frames, source = read(path, mask_is="labels")
    assert (frames, source.skipped) == ([], 1)
    with pytest.raises(InputError, match="mask_is must be one of"):
        FrameMaker("/image", mask_is="soft")


def test_on_the_command_line_masks_need_no_colour(tmp_path):
    path = written(tmp_path, masks(range(0, COUNT, 2)))
    out = tmp_path / "out.jsonl"
    result = run("track", path, "--mask-topic", MASKS, "--out", out)
    assert len(out.read_text().splitlines()) == COUNT // 2
    assert f"left out {COUNT // 2} images without a mask" in result.stderr
    for arguments, said in (
        (("--kind", "mask"), "--mask-topic goes with images"),
        (("--masks", "m/"), "--masks and --mask-topic are two sources of masks"),
    ):
        result = run("track", path, "--mask-topic", MASKS, *arguments, "--out", out, code=2)
        assert said in " ".join(result.stderr.split())
