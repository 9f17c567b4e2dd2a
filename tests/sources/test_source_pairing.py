"""Depth and masks beside the colour: rules, folders, stacks, counts, what is missing."""

from __future__ import annotations

import cv2
import numpy as np
import pytest

from dloftbs import sources
from dloftbs.errors import InputError, SourceError

SHAPE = (6, 8)


def save(path, pixels):
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(cv2.imencode(path.suffix, pixels)[1].tobytes())
    return path


def colour(number):
    image = np.zeros((*SHAPE, 3), np.uint8)
    image[1] = (number, 255, 0)
    return image


def depth(number):
    return np.full(SHAPE, 1000 + number, np.uint16)


def mask(number):
    return np.eye(*SHAPE, k=number, dtype=np.uint8) * 255


def depths(source):
    with source:
        return [None if frame.depth is None else float(frame.depth[0, 0]) for frame in source]


@pytest.fixture
def folder(tmp_path):
    """Colour files img1, img2, img10 with depth and masks beside them."""
    for number in (1, 2, 10):
        save(tmp_path / f"img{number}.png", colour(number))
        save(tmp_path / f"img{number}_depth.png", depth(number))
        save(tmp_path / f"img{number}_mask.png", mask(number % 5))
    return tmp_path


@pytest.mark.parametrize("pattern", ["", "/*.png"])
def test_rules(folder, pattern):
    where = f"{folder}{pattern}"
    with sources.open(where, depth="{stem}_depth.png", masks="{stem}_mask.png", fps=10) as source:
        assert (source.name, source.length, source.fps) == (where, 3, 10)
        frames = list(source)
    assert [frame.name for frame in frames] == ["img1.png", "img2.png", "img10.png"]
    for frame, number in zip(frames, (1, 2, 10), strict=True):
        np.testing.assert_array_equal(frame.image, colour(number))
        np.testing.assert_array_equal(frame.depth, depth(number))
        np.testing.assert_array_equal(frame.mask, mask(number % 5))


def test_occluders_by_a_rule_a_folder_and_a_stack(folder, tmp_path):
    hands = [mask(number) > 0 for number in range(3)]
    for number, hand in zip((1, 2, 10), hands, strict=True):
        save(folder / f"img{number}_hand.png", hand * np.uint8(255))
        save(folder / "hands" / f"{number}.png", hand * np.uint8(255))
    np.savez(folder / "hands.npz", occluders=np.array(hands))
    for where in ("{stem}_hand.png", folder / "hands", folder / "hands.npz"):
        with sources.open(f"{folder}/img*[0-9].png", occluders=where) as source:
            found = [frame.occluders > 0 for frame in source]
        np.testing.assert_array_equal(found, hands)
    (folder / "img2_hand.png").unlink()
    with sources.open(f"{folder}/img*[0-9].png", occluders="{stem}_hand.png") as source:
        assert [frame.occluders is None for frame in source] == [False, True, False]


def test_rule_into_another_folder(tmp_path):
    for number in range(3):
        save(tmp_path / "rgb" / f"{number}.jpg", colour(number))
        np.save(save(tmp_path / "depth" / f"{number}.png", depth(0)).with_suffix(".npy"), depth(number) / 1000)
    assert depths(sources.open(tmp_path / "rgb", depth="../depth/{stem}.npy")) == [1.0, 1.001, 1.002]
    # The other folder lies within the pattern, and its files must not become colour.
    assert depths(sources.open(f"{tmp_path}/**/*.*g", depth="../depth/{stem}.png")) == [1000.0] * 3


def test_rule_with_another_extension(tmp_path):
    save(tmp_path / "a.jpg", colour(1))
    save(tmp_path / "a.png", depth(7))
    assert depths(sources.open(tmp_path, depth="{stem}.png")) == [1007.0]


def test_rule_for_one_file_and_for_a_sequence(folder):
    paths = [folder / "img10.png", folder / "img1.png"]
    assert depths(sources.open(paths[0], depth="{stem}_depth.png")) == [1010.0]
    assert depths(sources.open(paths, depth="{stem}_depth.png")) == [1010.0, 1001.0]


def test_missing_partner(folder, caplog):
    (folder / "img2_depth.png").unlink()
    with sources.open(folder, depth="{stem}_depth.png", masks="{stem}_mask.png") as source:
        frames = list(source)
        assert source.skipped == 0
    assert [frame.depth is None for frame in frames] == [False, True, False]
    assert [record.getMessage().split(":")[0] for record in caplog.records] == ["frame 1 goes without depth"]
    assert "img2_depth.png" in caplog.text


def test_partner_without_colour_is_left_out(folder, caplog):
    (folder / "img2.png").unlink()
    with sources.open(folder, depth="{stem}_depth.png", masks="{stem}_mask.png") as source:
        assert [frame.name for frame in source] == ["img1.png", "img10.png"]
    assert "left out" in caplog.text
    assert "img2_depth.png" in caplog.text


def test_colour_that_is_named_like_a_partner_stays(tmp_path):
    for name in ("og.png", "x.png"):
        save(tmp_path / name, colour(1))
    save(tmp_path / "d og.png", colour(2))
    save(tmp_path / "d d og.png", depth(3))
    save(tmp_path / "d x.png", depth(4))
    (tmp_path / "og.png").unlink()
    with sources.open(tmp_path, depth="d {stem}.png") as source:
        assert {frame.name: frame.depth[0, 0] for frame in source} == {"d og.png": 1003, "x.png": 1004}


def test_nothing_but_partners(tmp_path):
    save(tmp_path / "a.png", colour(1))
    with pytest.raises(SourceError, match=r"partner of another under \{stem\}\.png"):
        sources.open(tmp_path, depth="{stem}.png")


def test_folder_and_glob_of_depth(folder, tmp_path):
    for number in (1, 2, 10):
        save(tmp_path / "d" / f"frame{number}.tif", depth(number).astype(np.float32) / 1000)
    where = f"{folder}/img*[0-9].png"
    expected = np.array([1.001, 1.002, 1.010], np.float32).tolist()
    assert depths(sources.open(where, depth=tmp_path / "d")) == expected
    assert depths(sources.open(where, depth=f"{tmp_path}/d/*.tif")) == expected


@pytest.mark.parametrize("count", [2, 4])
def test_counts_must_agree(folder, tmp_path, count):
    for number in range(count):
        save(tmp_path / "d" / f"{number}.png", depth(number))
    with pytest.raises(SourceError, match=f"depth must have as many frames as .*, which has 3; got {count}"):
        sources.open(f"{folder}/img*[0-9].png", depth=tmp_path / "d")


def numbered(folder, numbers, pixels, start=0, step=1, form="{:06d}.png"):
    for number in numbers:
        save(folder / form.format(start + step * number), pixels(number))


def test_files_of_a_folder_go_by_name(tmp_path, caplog):
    numbered(tmp_path / "rgb", (0, 1, 2, 4, 5), colour)
    numbered(tmp_path / "d", (0, 1, 2, 3, 4), depth)
    assert depths(sources.open(tmp_path / "rgb", depth=tmp_path / "d")) == [1000.0, 1001.0, 1002.0, 1004.0, None]
    left_out, missing = (record.getMessage() for record in caplog.records)
    assert left_out == f"{tmp_path / 'd'}: left out 1 file, such as 000003.png: no frame has the name"
    assert missing == "frame 4 goes without depth: no file of the folder has its name"


@pytest.mark.parametrize(("start", "step", "numbers"), [(1, 1, range(5)), (0, 2, range(5)), (1, 1, (0, 1, 2, 4, 5))])
def test_files_that_are_numbered_otherwise_go_by_order(tmp_path, caplog, start, step, numbers):
    numbered(tmp_path / "rgb", numbers, colour)
    numbered(tmp_path / "d", numbers, depth, start=start, step=step)
    assert depths(sources.open(tmp_path / "rgb", depth=tmp_path / "d")) == [1000.0 + number for number in numbers]
    (record,) = caplog.records
    assert "by their order, since the numbers in the names differ" in record.getMessage()


def test_other_names_with_other_numbers_are_reported(tmp_path, caplog):
    numbered(tmp_path / "rgb", (0, 1, 2, 4, 5), colour, form="rgb16_{}.png")
    numbered(tmp_path / "d", (0, 1, 2, 3, 4), depth, form="depth_{}_16bit.png")
    numbered(tmp_path / "e", (0, 1, 2, 3, 4), depth, form="{}.tiff")
    with sources.open(tmp_path / "rgb", depth=tmp_path / "d"):
        assert not caplog.records  # 16 is no number of a frame
    with sources.open(tmp_path / "rgb", depth=tmp_path / "e"):
        (record,) = caplog.records
    assert record.getMessage().endswith("numbers in the names differ: 3.tiff goes with rgb16_4.png")


def test_stems_that_are_there_twice_go_by_order(tmp_path, caplog):
    for run in "ab":
        numbered(tmp_path / run / "rgb", (0, 1, 2), colour)
        numbered(tmp_path / run / "d", (0, 1, 2), depth)
    source = sources.open(f"{tmp_path}/*/rgb/*.png", depth=f"{tmp_path}/*/d/*.png")
    assert depths(source) == [1000.0, 1001.0, 1002.0] * 2
    assert not caplog.records


def test_stacks(tmp_path):
    images = np.stack([colour(number) for number in range(4)])
    stack = np.stack([depth(number) for number in range(4)])
    np.save(tmp_path / "d.npy", stack)
    np.savez_compressed(tmp_path / "m.npz", masks=stack > 1001, depth=stack + 5)
    expected = [1000.0, 1001.0, 1002.0, 1003.0]
    assert depths(sources.open(images, depth=tmp_path / "d.npy")) == expected
    with sources.open(images, depth=tmp_path / "m.npz", masks=tmp_path / "m.npz") as source:
        for _ in range(2):
            frames = list(source)
            assert [frame.depth[0, 0] for frame in frames] == [1005, 1006, 1007, 1008]
            assert [frame.mask.any() for frame in frames] == [False, False, True, True]
            assert all(frame.image is not None for frame in frames)
    with pytest.raises(SourceError, match="which has 3; got 4"):
        sources.open(images[:3], depth=tmp_path / "d.npy")
    np.savez(tmp_path / "n.npz", depth=stack)
    with pytest.raises(SourceError, match="needs the array 'masks'; found depth"):
        sources.open(images, masks=tmp_path / "n.npz")
    np.save(tmp_path / "f.npy", stack * 1.0)
    with pytest.raises(SourceError, match=r"f\.npy: mask must be a probability in 0\.\.1 .*, got 1000\.\.1000"):
        sources.open(images, masks=tmp_path / "f.npy")


def test_own_depth_is_replaced(tmp_path):
    images = np.stack([colour(number) for number in range(2)])
    np.savez(tmp_path / "a.npz", images=images, depth=np.ones((2, *SHAPE)))
    np.save(tmp_path / "d.npy", np.full((2, *SHAPE), 2.0))
    np.save(tmp_path / "small.npy", np.full((2, 3, 3), 3.0))
    assert depths(sources.open(tmp_path / "a.npz")) == [1.0, 1.0]
    assert depths(sources.open(tmp_path / "a.npz", depth=tmp_path / "d.npy")) == [2.0, 2.0]
    with pytest.raises(InputError, match=r"a\.npz#0: depth must have the frame's size \(6, 8\).*registration"):
        depths(sources.open(tmp_path / "a.npz", depth=tmp_path / "small.npy"))


def test_one_file_beside_another(tmp_path):
    save(tmp_path / "a.png", colour(0))
    np.save(tmp_path / "d.npy", depth(5))
    assert depths(sources.open(tmp_path / "a.png", depth=save(tmp_path / "d.png", depth(3)))) == [1003.0]
    assert depths(sources.open(tmp_path / "a.png", depth=tmp_path / "d.npy")) == [1005.0]
    assert depths(sources.open(tmp_path / "a.png", depth="{stem}/../d.npy")) == [1005.0]


@pytest.mark.parametrize(
    ("pixels", "message"),
    [
        (np.zeros(SHAPE, np.uint8), "16 bits or more or of floating point.*uint8"),
        (np.zeros((*SHAPE, 3), np.uint16), "one channel"),
    ],
)
def test_unsuitable_depth(tmp_path, caplog, pixels, message):
    for number in range(2):
        save(tmp_path / f"{number}.png", colour(number))
        save(tmp_path / f"{number}_d.png", depth(number))
    save(tmp_path / "0_d.png", pixels)
    assert depths(sources.open(tmp_path, depth="{stem}_d.png")) == [None, 1001.0]
    (record,) = caplog.records
    assert record.getMessage().startswith("frame 0 goes without depth")
    assert message.split(".*")[0] in record.getMessage()


def test_corrupt_partners(tmp_path, caplog):
    for number in range(3):
        save(tmp_path / f"{number}.png", colour(number))
    (tmp_path / "0_d.npy").write_bytes(b"nonsense")
    np.save(tmp_path / "1_d.npy", np.array(["text"]))
    np.save(tmp_path / "2_d.npy", depth(2))
    assert depths(sources.open(tmp_path, depth="{stem}_d.npy")) == [None, None, 1002.0]
    assert len(caplog.records) == 2


def test_masks_from_npy(tmp_path, caplog):
    for number in range(2):
        save(tmp_path / f"{number}.png", colour(number))
        np.save(tmp_path / f"{number}.npy", [mask(1), mask(1) * 0.5][number])
    with sources.open(tmp_path, masks="{stem}.npy") as source:
        first, second = source
    np.testing.assert_array_equal(first.mask, mask(1))
    assert second.mask is None
    assert "1.npy: mask must be a probability in 0..1" in caplog.text


def test_grey_images_with_masks_are_images(tmp_path):
    save(tmp_path / "0.png", colour(3)[..., 1])
    save(tmp_path / "0_mask.png", mask(1))
    with sources.open(tmp_path, masks="{stem}_mask.png") as source:
        (frame,) = source
    np.testing.assert_array_equal(frame.image[..., 0], colour(3)[..., 1])
    np.testing.assert_array_equal(frame.mask, mask(1))


def test_holes_do_not_shift_the_pairs(tmp_path, caplog):
    for number in range(4):
        save(tmp_path / "rgb" / f"{number}.png", colour(number))
        save(tmp_path / "d" / f"{number}.png", depth(number))
    (tmp_path / "rgb" / "1.png").write_bytes(b"")
    source = sources.open(tmp_path / "rgb", depth=tmp_path / "d")
    frames = iter(source)
    found = [(frame.index, int(frame.depth[0, 0]), source.skipped) for frame in frames]
    assert found == [(0, 1000, 0), (2, 1002, 1), (3, 1003, 1)]
    (tmp_path / "rgb" / "3.png").write_bytes(b"")
    assert len(list(source)) == 2
    assert source.skipped == 2


def test_video_with_a_stack(tmp_path, caplog):
    writer = cv2.VideoWriter(str(tmp_path / "a.mp4"), cv2.VideoWriter_fourcc(*"mp4v"), 10.0, (64, 48))
    for _ in range(3):
        writer.write(np.zeros((48, 64, 3), np.uint8))
    writer.release()
    np.save(tmp_path / "d.npy", np.arange(3)[:, None, None] + np.ones((3, 48, 64)))
    assert depths(sources.open(tmp_path / "a.mp4", depth=tmp_path / "d.npy")) == [1.0, 2.0, 3.0]
    with pytest.raises(InputError, match=r"naming rule .* files of their own"):
        sources.open(tmp_path / "a.mp4", depth="{stem}.png")
    # More frames than the container told: the rest goes without.
    source = sources.open(tmp_path / "a.mp4")
    source.length = None
    np.save(tmp_path / "d.npy", np.ones((2, 48, 64)))
    partner = sources.pairing.open_partner("depth", str(tmp_path / "d.npy"), None)
    assert depths(sources.PairedSource(source, {"depth": partner})) == [1.0, 1.0, None]
    assert "frame 2 goes without depth: there are only 2" in caplog.text


def test_missing_places(tmp_path):
    save(tmp_path / "a.png", colour(0))
    (tmp_path / "empty").mkdir()
    with pytest.raises(SourceError, match=r"depth: there is no file or folder 'gone'.*\{stem\}"):
        sources.open(tmp_path / "a.png", depth="gone")
    with pytest.raises(SourceError, match=r"nothing matches the pattern 'gone\*\.png'"):
        sources.open(tmp_path / "a.png", depth="gone*.png")
    with pytest.raises(SourceError, match=r"folder .*empty.* no file that ends in \.png.*\.npy"):
        sources.open(tmp_path / "a.png", masks=tmp_path / "empty")


def test_closing_closes_both(tmp_path):
    np.savez(tmp_path / "a.npz", images=np.stack([colour(0)] * 3))
    np.savez(tmp_path / "d.npz", depth=np.stack([depth(0)] * 3))
    source = sources.open(tmp_path / "a.npz", depth=tmp_path / "d.npz")
    frames = iter(source)
    next(frames)
    source.close()
    assert list(frames) == []
    with pytest.raises(SourceError, match="closed"):
        iter(source)


@pytest.mark.parametrize("where", ["{stem}_soft.npy", "{stem}_soft.jpg", "softs.npy"])
def test_masks_beside_images_are_what_is_said_of_them_and_occluders_as_ever(folder, where):
    soft = np.repeat(np.array([[0, 40, 200]], np.uint8), 8, 0).repeat(8, 1)
    stems = ("img1", "img2", "img10")
    for stem in stems:
        save(folder / f"{stem}.png", np.dstack([soft, soft, 255 - soft]))
        np.save(folder / f"{stem}_soft.npy", np.float32(soft / 255.0))
        cv2.imwrite(str(folder / f"{stem}_soft.jpg"), soft, [cv2.IMWRITE_JPEG_QUALITY, 100])
    np.save(folder / "softs.npy", np.stack([np.float32(soft / 255.0)] * 3))
    masks = where if "{" in where else folder / where
    with sources.open(f"{folder}/img*[0-9].png", masks=masks, mask_is="probability") as source:
        for frame in source:
            assert frame.mask_is == "probability"
            assert np.abs(frame.mask.astype(int) - soft).max() <= 2
    cables = {"binary": soft > (100 if "jpg" in where else 0), "auto": soft > 100}
    for mask_is, expected in cables.items():
        with sources.open(f"{folder}/img*[0-9].png", masks=masks, mask_is=mask_is) as source:
            assert all(np.array_equal(frame.is_cable, expected) for frame in source)
    if "jpg" in where:
        for mask_is in ("probability", "labels"):
            with sources.open(f"{folder}/img*[0-9].png", occluders=masks, mask_is=mask_is) as source:
                assert all(np.array_equal(frame.occluders, soft > 100) for frame in source)


def test_labels_in_a_mask_give_way_to_instances_and_stay_the_mask(folder):
    labels = np.zeros(SHAPE, np.uint8)
    labels[1], labels[3] = 1, 2
    for stem in ("img1", "img2", "img10"):
        save(folder / f"{stem}_mask.png", labels)
        save(folder / f"{stem}_one.png", labels // 2)
    options = {"masks": "{stem}_mask.png", "instances": "{stem}_one.png", "depth": "{stem}_depth.png"}
    with sources.open(folder, mask_is="labels", **options) as source:
        for frame in source:
            np.testing.assert_array_equal(frame.mask, labels)
            np.testing.assert_array_equal(frame.instances, labels // 2)
