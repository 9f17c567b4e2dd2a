"""PNG files of indexed colour: labels count by their index, pictures by their colours."""

from __future__ import annotations

import io
from pathlib import Path

import cv2
import numpy as np
import pytest

from dloftbs import sources
from dloftbs.errors import SourceError
from dloftbs.sources.indexed_colour import MAX_LABELS
from dloftbs_lab import open_labelled

Image = pytest.importorskip("PIL.Image")

VOC = [(0, 0, 0), (128, 0, 0), (0, 128, 0), (128, 128, 0)]
LABELS = np.zeros((40, 61), np.uint8)
LABELS[5:9, 3:50] = 1
LABELS[20:25, 8:60] = 2
LABELS[30:33] = 3


def indexed(indices: np.ndarray, palette: list[tuple[int, int, int]], **options: int) -> bytes:
    image = Image.new("P", indices.shape[::-1])
    image.putdata(indices.ravel().tolist())
    image.putpalette([value for colour in palette for value in colour])
    stream = io.BytesIO()
    image.save(stream, "PNG", **options)
    return stream.getvalue()


def save(path: Path, data: bytes) -> Path:
    path.write_bytes(data)
    return path


def only(source: sources.Source) -> sources.Frame:
    with source:
        (frame,) = source
    return frame


@pytest.mark.parametrize("bits", [1, 2, 4, 8])
def test_the_index_is_the_label_at_every_depth_of_bits(tmp_path: Path, bits: int) -> None:
    indices = np.minimum(LABELS, 2**bits - 1)
    palette = [*VOC[: 2**bits], *[(9, 9, 9)] * max(0, 2**bits - 4)]
    data = indexed(indices, palette, bits=bits)
    assert (data[24], data[25]) == (bits, 3)
    np.testing.assert_array_equal(only(sources.open(save(tmp_path / "a.png", data))).mask, indices)


@pytest.mark.parametrize(
    "palette",
    [
        [(255, 255, 255), (0, 0, 0), (255, 0, 0), (0, 0, 0)],  # the ground is white, and objects are black
        [(0, 0, 0)] * 4,
        [(7, 8, 9), (7, 8, 9), (1, 2, 3), (1, 2, 3)],
    ],
    ids=["black objects", "all black", "twice the same"],
)
def test_as_a_mask_index_0_is_ground_whatever_the_colours(tmp_path: Path, palette: list[tuple[int, int, int]]) -> None:
    path = save(tmp_path / "a.png", indexed(LABELS, palette))
    np.testing.assert_array_equal(only(sources.open(path, kind="mask")).mask, LABELS)


def test_masks_beside_images_are_indexed_too(tmp_path: Path) -> None:
    cv2.imwrite(str(tmp_path / "a.jpg"), np.full((40, 61, 3), 90, np.uint8))
    save(tmp_path / "a_mask.png", indexed(LABELS, [(255, 255, 255), *VOC[1:]]))
    frame = only(sources.open(tmp_path, masks="{stem}_mask.png"))
    assert frame.image is not None
    np.testing.assert_array_equal(frame.mask != 0, LABELS != 0)


def test_an_image_stays_an_image_when_it_is_asked_for(tmp_path: Path) -> None:
    frame = only(sources.open(save(tmp_path / "a.png", indexed(LABELS, VOC)), kind="image"))
    np.testing.assert_array_equal(frame.image, np.array(VOC, np.uint8)[LABELS][..., ::-1])
    assert frame.mask is None


def busy(count: int) -> np.ndarray:
    """Index 0 in half of the image, and all others."""
    indices = np.zeros((40, 64), np.uint8)
    indices[20:] = np.random.default_rng(0).integers(0, count, (20, 64))
    assert len(np.unique(indices)) == count
    return indices


@pytest.mark.parametrize(
    ("indices", "palette"),
    [
        (busy(MAX_LABELS + 1), [(i, 2 * i, 0) for i in range(MAX_LABELS + 1)]),
        (LABELS, [(255, 255, 255), *VOC[1:]]),
        (3 - LABELS, VOC),
    ],
    ids=["a photograph of many colours", "a screenshot on white", "index 0 is not the ground"],
)
def test_a_picture_of_few_colours_is_no_mask(
    tmp_path: Path, indices: np.ndarray, palette: list[tuple[int, int, int]]
) -> None:
    frame = only(sources.open(save(tmp_path / "a.png", indexed(indices, palette))))
    np.testing.assert_array_equal(frame.image, np.array(palette, np.uint8)[indices][..., ::-1])


def test_labels_of_many_objects_are_a_mask(tmp_path: Path) -> None:
    indices = busy(MAX_LABELS)
    data = indexed(indices, [(i, 2 * i, 0) for i in range(MAX_LABELS)])
    np.testing.assert_array_equal(only(sources.open(save(tmp_path / "a.png", data))).mask, indices)


def test_a_palette_of_greys_is_a_mask_as_other_grey_files_are(tmp_path: Path) -> None:
    data = indexed(LABELS, [(200, 200, 200), (0, 0, 0), (9, 9, 9), (3, 3, 3)])
    np.testing.assert_array_equal(only(sources.open(save(tmp_path / "a.png", data))).mask, LABELS)


def test_transparency_changes_nothing(tmp_path: Path) -> None:
    data = indexed(LABELS, VOC, transparency=0)
    assert b"tRNS" in data
    np.testing.assert_array_equal(only(sources.open(save(tmp_path / "a.png", data))).mask, LABELS)


@pytest.mark.parametrize("kind", ["auto", "mask"])
def test_a_damaged_one_is_refused(tmp_path: Path, kind: sources.Kind) -> None:
    data = indexed(LABELS, VOC)
    at = data.index(b"IDAT") + 4
    for broken in (data[: at + 9], data[:at] + bytes(8) + data[at + 8 :], data[:17] + b"\7" + data[18:], data[:30]):
        with pytest.raises(SourceError, match=r"a\.png: cannot be decoded"):
            only(sources.open(save(tmp_path / "a.png", broken), kind=kind))


def test_labelled_data_may_be_indexed(tmp_path: Path) -> None:
    cv2.imwrite(str(tmp_path / "0.jpg"), np.full((40, 61, 3), 90, np.uint8))
    save(tmp_path / "0.labels.png", indexed(LABELS, [(255, 255, 255), *VOC[1:]]))
    with open_labelled(tmp_path) as sequence:
        truth = sequence.truth(0)
    assert truth.ids == (1, 2, 3)
    for number, mask in zip(truth.ids, truth.visible_masks, strict=True):
        np.testing.assert_array_equal(mask, number == LABELS)
