"""The one frame of a file, and what goes with it."""

from __future__ import annotations

import cv2
import numpy as np
import pytest

from dloftbs.errors import InputError, SourceError
from dloftbs.sources.one_frame import read_beside, read_frame

MASK = np.zeros((8, 9), np.uint8)
MASK[3:5] = 255
DEPTH = np.arange(72, dtype=np.uint16).reshape(8, 9)


@pytest.fixture(autouse=True)
def _here(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    cv2.imwrite("a.png", MASK)
    cv2.imwrite("a_depth.png", DEPTH)


@pytest.mark.parametrize("shape", [(8, 9), (8, 9, 1), (1, 8, 9), (1, 1, 8, 9)])
def test_a_stack_of_one_is_a_frame(shape):
    np.save("b.npy", MASK.reshape(shape))
    np.testing.assert_array_equal(read_frame("b.npy").mask, MASK)


def test_the_kind_is_what_is_asked_for():
    assert read_frame("a.png").image is None
    assert read_frame("a.png", "image").mask is None


class InBytes:
    """A path that is bytes, as `os.scandir` of bytes gives them."""

    def __init__(self, path):
        self.path = path

    def __fspath__(self):
        return self.path


def test_a_path_may_be_bytes():
    np.testing.assert_array_equal(read_frame(InBytes(b"a.png")).mask, MASK)
    np.testing.assert_array_equal(read_beside("depth", InBytes(b"{stem}_depth.png"), InBytes(b"a.png")), DEPTH)


def test_an_animation_is_a_stream():
    pillow = pytest.importorskip("PIL.Image")
    first, second = pillow.fromarray(MASK), pillow.fromarray(255 - MASK)
    first.save("b.png", save_all=True, append_images=[second])
    with pytest.raises(InputError, match=r"'b\.png' holds several; track\('b\.png'\)"):
        read_frame("b.png")


def test_a_folder_is_a_stream_even_if_it_holds_one_picture(tmp_path):
    with pytest.raises(InputError, match="expected the file of one picture"):
        read_frame(tmp_path)


def test_what_is_broken_is_said():
    with open("b.png", "wb") as file:
        file.write(b"\x89PNG")
    with pytest.raises(SourceError, match=r"b\.png"):
        read_frame("b.png")
    with pytest.raises(SourceError, match=r"b\.png"):
        read_beside("depth", "b.png", MASK)
    with pytest.raises(SourceError, match=r"a\.png: depth must have one channel of 16 bits"):
        read_beside("depth", "a.png", MASK)


@pytest.mark.parametrize("kind", [np.uint8, np.int8, bool, complex])
def test_a_picture_of_depth_is_none_in_an_array_either(kind):
    np.save("8.npy", DEPTH.astype(kind))
    with pytest.raises(SourceError, match=r"8\.npy: .*depth must have"):
        read_beside("depth", "8.npy", MASK)


def test_a_naming_rule_is_relative_to_the_picture(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path.parent)
    np.testing.assert_array_equal(read_beside("depth", "{stem}_depth.png", tmp_path / "a.png"), DEPTH)
    with pytest.raises(InputError, match="needs the path of a picture, got None"):
        read_beside("depth", "{stem}_depth.png", None)


@pytest.mark.parametrize(("what", "key"), [("depth", "depth"), ("mask", "masks"), ("occluders", "occluders")])
def test_an_archive_with_one_frame_is_read_by_its_key(what, key):
    np.savez("b.npz", **{key: DEPTH[None]})
    np.testing.assert_array_equal(read_beside(what, "b.npz", MASK), DEPTH)
    np.savez("c.npz", **{key: np.stack([DEPTH] * 2)})
    with pytest.raises(SourceError, match=f"{what} must hold one frame, got 2"):
        read_beside(what, "c.npz", MASK)
    np.savez("d.npz", other=DEPTH)
    with pytest.raises(SourceError, match=f"needs the array '{key}'"):
        read_beside(what, "d.npz", MASK)


def test_a_file_is_what_is_said_of_its_values():
    cv2.imwrite("soft.jpg", np.full((16, 16), 100, np.uint8))
    assert read_frame("soft.jpg", mask_is="probability").mask.max() == 100
    assert not read_frame("soft.jpg").mask.any()
    assert read_frame("soft.jpg", mask_is="probability", as_stored=True).mask.max() == 100
