"""Arrays, tensors and pictures of other libraries, by doubles that behave as theirs do."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import dloftbs
from dloftbs import Frame, InputError
from dloftbs.support.array_likes import as_array, as_pixels, is_array_like

MASK = np.zeros((60, 120), np.uint8)
MASK[25:31, 10:110] = 255
IMAGE = np.full((60, 120, 3), 90, np.uint8)
IMAGE[MASK > 0] = (30, 20, 210)
RED = "170:10,80:255,60:255"


class Tensor:
    """What PyTorch's tensors do: no array while they have a gradient, are on a GPU, or of a type NumPy lacks."""

    def __init__(self, array: np.ndarray, requires_grad: bool = False, device: str = "cpu", dtype: str = "") -> None:
        self.array, self.requires_grad, self.device = array, requires_grad, device
        self.dtype = dtype or f"torch.{array.dtype}"
        self.shape = array.shape

    def detach(self) -> Tensor:
        return Tensor(self.array, False, self.device, self.dtype)

    def cpu(self) -> Tensor:
        return Tensor(self.array, self.requires_grad, "cpu", self.dtype)

    def float(self) -> Tensor:
        return Tensor(self.array.astype(np.float32), self.requires_grad, self.device, "torch.float32")

    def __array__(self, dtype: Any = None, copy: Any = None) -> np.ndarray:
        if self.requires_grad:
            raise RuntimeError("Can't call numpy() on Tensor that requires grad. Use tensor.detach().numpy() instead.")
        if self.device != "cpu":
            raise TypeError(f"can't convert {self.device} device type tensor to numpy.")
        if "bfloat16" in self.dtype:
            raise TypeError("Got unsupported ScalarType BFloat16")
        return self.array

    def __len__(self) -> int:
        return len(self.array)

    def __getitem__(self, key: Any) -> Tensor:
        return Tensor(self.array[key], self.requires_grad, self.device, self.dtype)


class OnDevice:
    """What CuPy's arrays do: no array without being asked for."""

    def __init__(self, array: np.ndarray) -> None:
        self._array = array
        self.__cuda_array_interface__ = {"shape": array.shape}

    def get(self) -> np.ndarray:
        return self._array

    def __array__(self, dtype: Any = None, copy: Any = None) -> np.ndarray:
        raise TypeError("Implicit conversion to a NumPy array is not allowed. Please use `.get()`.")


class Shared:
    """An array of a library that has the protocol of DLPack alone."""

    def __init__(self, array: np.ndarray) -> None:
        self._array = array

    def __dlpack__(self, **given: Any) -> Any:
        return self._array.__dlpack__(**given)

    def __dlpack_device__(self) -> tuple[int, int]:
        return self._array.__dlpack_device__()


class Plain:
    """An array as those of JAX and TensorFlow: it hands itself out."""

    def __init__(self, array: np.ndarray) -> None:
        self._array = array

    def __array__(self, dtype: Any = None, copy: Any = None) -> np.ndarray:
        return self._array


class Picture:
    """A picture as Pillow has it."""

    def __init__(self, mode: str, pixels: np.ndarray, rgb: np.ndarray | None = None) -> None:
        self.mode, self._pixels, self._rgb = mode, pixels, rgb
        self.size = pixels.shape[1::-1]

    def convert(self, mode: str) -> Picture:
        if self._rgb is None:
            raise ValueError(f"conversion from {self.mode} to {mode} not supported")
        return Picture(mode, self._rgb)

    @property
    def __array_interface__(self) -> dict[str, Any]:
        return self._pixels.__array_interface__


LIKES: dict[str, Callable[[np.ndarray], Any]] = {
    "a tensor": Tensor,
    "a tensor with a gradient": lambda array: Tensor(array, requires_grad=True),
    "a tensor on a GPU": lambda array: Tensor(array, device="cuda:0"),
    "a tensor on a GPU with a gradient": lambda array: Tensor(array, True, "cuda:0"),
    "an array on a GPU": OnDevice,
    "an array that is shared": Shared,
    "an array that hands itself out": Plain,
    "lists": lambda array: array.tolist(),
    "Fortran order": np.asfortranarray,
    "backwards": lambda array: array[::-1].copy()[::-1],
}


def found(result: dloftbs.FrameResult) -> list[dloftbs.BSplineCurve]:
    assert len(result) == 1
    return [detection.curve for detection in result]


@pytest.mark.parametrize("like", LIKES.values(), ids=LIKES)
class TestLikes:
    def test_a_mask_is_taken(self, like: Callable[[np.ndarray], Any]) -> None:
        assert found(dloftbs.detect(like(MASK))) == found(dloftbs.detect(MASK))
        assert np.array_equal(Frame(mask=like(MASK)).mask, MASK)

    def test_an_image_is_taken(self, like: Callable[[np.ndarray], Any]) -> None:
        expected = found(dloftbs.detect(IMAGE, hsv=RED))
        assert found(dloftbs.detect(like(IMAGE), hsv=RED)) == expected

    def test_a_stack_is_taken(self, like: Callable[[np.ndarray], Any]) -> None:
        for shape in ((3, 60, 120), (3, 1, 60, 120), (3, 60, 120, 1)):
            stack = np.stack([MASK] * 3).reshape(shape)
            assert [len(result) for result in dloftbs.track(like(stack))] == [1, 1, 1]

    def test_depth_is_taken(self, like: Callable[[np.ndarray], Any]) -> None:
        depth = np.full(MASK.shape, 0.5, np.float32)
        (detection,) = dloftbs.detect(MASK, depth=like(depth), camera=(200.0, 200.0, 60.0, 30.0))
        assert detection.curve_3d is not None


def test_a_mapped_file_is_no_picture_although_it_has_a_mode(tmp_path: Path) -> None:
    np.save(tmp_path / "mask.npy", MASK)
    mapped = np.load(tmp_path / "mask.npy", mmap_mode="r")
    assert mapped.mode == "r"
    assert found(dloftbs.detect(mapped)) == found(dloftbs.detect(MASK))


@pytest.mark.parametrize("dtype", [">u2", ">i4", "<u8", ">i8"])
def test_either_order_of_bytes_is_taken(dtype: str) -> None:
    assert found(dloftbs.detect((MASK > 0).astype(dtype))) == found(dloftbs.detect(MASK))


def test_depth_of_a_type_that_numpy_lacks_is_widened() -> None:
    depth = Tensor(np.full(MASK.shape, 0.5), dtype="torch.bfloat16")
    assert np.array_equal(Frame(mask=MASK, depth=depth).depth, np.full(MASK.shape, 0.5, np.float32))


def test_a_stream_of_tensors_is_taken() -> None:
    results = dloftbs.track(Tensor(MASK[None], requires_grad=True) for _ in range(2))
    assert [len(result) for result in results] == [1, 1]


def test_pixels_that_are_masked_are_not_set() -> None:
    masked = np.ma.masked_array(MASK, MASK == 7)
    masked[:, 50:60] = np.ma.masked
    expected = MASK.copy()
    expected[:, 50:60] = 0
    assert np.array_equal(Frame(mask=masked).mask, expected)
    depth = np.ma.masked_array(MASK.astype(np.uint16), masked.mask)
    assert np.array_equal(Frame(mask=masked, depth=depth).depth, expected)


def test_numbers_that_are_masked_are_refused() -> None:
    with pytest.raises(InputError, match="a camera matrix has masked values"):
        dloftbs.PinholeCamera.from_matrix(np.ma.masked_array(np.eye(3), np.eye(3) > 0))
    assert np.array_equal(as_array("k", np.ma.masked_array(np.eye(3))), np.eye(3))


class TestPictures:
    RGB = np.ascontiguousarray(IMAGE[..., ::-1])

    @pytest.mark.parametrize(
        "picture",
        [
            Picture("RGB", RGB),
            Picture("RGBA", np.dstack([RGB, MASK])),
            Picture("RGBX", np.dstack([RGB, MASK])),
            Picture("CMYK", np.zeros((60, 120, 4), np.uint8), RGB),
            Picture("YCbCr", np.zeros((60, 120, 3), np.uint8), RGB),
        ],
        ids=lambda picture: picture.mode,
    )
    def test_colours_become_blue_green_red(self, picture: Picture) -> None:
        assert np.array_equal(Frame(image=picture).image, IMAGE)
        assert found(dloftbs.detect(picture, hsv=RED)) == found(dloftbs.detect(IMAGE, hsv=RED))
        assert [len(result) for result in dloftbs.track([picture] * 2, hsv=RED)] == [1, 1]

    def test_an_array_that_says_its_order_is_turned(self) -> None:
        class Ordered(np.ndarray):
            mode = "RGB"

        assert np.array_equal(Frame(image=self.RGB.view(Ordered)).image, IMAGE)

    @pytest.mark.parametrize("mode", ["L", "LA", "P", "PA", "1"])
    def test_any_picture_is_one_beside_a_mask(self, mode: str) -> None:
        assert np.array_equal(Frame(mask=MASK, image=Picture(mode, MASK, self.RGB)).image, IMAGE)

    @pytest.mark.parametrize(
        ("mode", "pixels"), [("L", MASK), ("1", MASK > 0), ("I", MASK.astype(np.int32)), ("I;16", MASK.astype("<u2"))]
    )
    def test_one_channel_is_a_mask(self, mode: str, pixels: np.ndarray) -> None:
        assert found(dloftbs.detect(Picture(mode, pixels))) == found(dloftbs.detect(MASK))

    def test_one_channel_is_depth(self) -> None:
        depth = Frame(mask=MASK, depth=Picture("I;16", MASK.astype("<u2"))).depth
        assert np.array_equal(depth, MASK)

    def test_labels_are_a_mask_where_one_is_asked_for(self) -> None:
        assert np.array_equal(Frame(mask=Picture("P", MASK)).mask, MASK)

    @pytest.mark.parametrize(
        ("make", "message"),
        [
            (
                lambda: dloftbs.detect(Picture("P", MASK)),
                r"mode P.*x\.convert\('RGB'\) .* np\.asarray\(x\) for its mask",
            ),
            (lambda: dloftbs.detect(Picture("LA", IMAGE[..., :2])), r"mode LA.*x\.getchannel\(0\) or"),
            (lambda: Frame(mask=Picture("RGB", IMAGE)), r"must have one channel.*mask\.convert\('L'\)"),
            (lambda: Frame(mask=MASK, image=Picture("I;16", MASK)), "8 bits a channel, got a picture of mode I;16"),
            (lambda: dloftbs.detect(Picture("LAB", IMAGE)), "mode LAB cannot be turned into RGB: conversion from LAB"),
            (lambda: dloftbs.detect(Picture("F", 1.0 * MASK + 1.0)), r"mask must be a probability in 0\.\.1"),
            (lambda: dloftbs.detect(Picture("RGB", MASK)), r"says that its mode is RGB, and has shape \(60, 120\)"),
            (lambda: dloftbs.track(Picture("RGB", IMAGE)), "got a single frame"),
        ],
    )
    def test_the_rest_is_refused_with_the_call(self, make: Callable[[], Any], message: str) -> None:
        with pytest.raises(InputError, match=message):
            make()

    def test_pillow_s_own(self) -> None:
        pillow = pytest.importorskip("PIL.Image")
        picture = pillow.fromarray(self.RGB)
        for mode in ("RGB", "RGBA", "RGBX", "HSV", "CMYK"):
            assert found(dloftbs.detect(picture.convert(mode), hsv=RED)) == found(dloftbs.detect(IMAGE, hsv=RED))
        for mode in ("L", "1", "I"):
            assert found(dloftbs.detect(pillow.fromarray(MASK).convert(mode))) == found(dloftbs.detect(MASK))
        with pytest.raises(InputError, match=r"x\.convert\('RGB'\)"):
            dloftbs.detect(picture.convert("P"))


class TestNoArrays:
    @pytest.mark.parametrize(
        ("value", "message"),
        [
            (None, r"x is None \(cv2\.imread returns None where the path does not exist or is no image\)"),
            ("a.png", r"x must be an array, got 'a\.png'; detect, track and sources\.open read files"),
            ({"image": IMAGE, "mask": MASK}, r"x must be an array, got a dict with the keys 'image', 'mask'$"),
            (object(), "x must be an array, got <object object"),
            (5, "x must be an array, got 5"),
            ([[1], [1, 2]], r"x must be an array of numbers, got \[\[1\], \[1, 2\]\]: .*inhomogeneous"),
        ],
    )
    def test_the_message_says_what_came(self, value: object, message: str) -> None:
        with pytest.raises(InputError, match=message):
            as_pixels("x", value, "any")

    def test_an_error_of_another_library_is_quoted(self) -> None:
        class Symbolic:
            def __array__(self, dtype: Any = None, copy: Any = None) -> np.ndarray:
                raise NotImplementedError("cannot convert a symbolic tensor")

        with pytest.raises(InputError, match=r"the frame must be an array.*cannot convert a symbolic tensor"):
            dloftbs.detect(Symbolic())

    def test_an_open_file_is_no_picture(self, tmp_path: Path) -> None:
        (tmp_path / "a.png").write_bytes(b"\x89PNG")
        with (tmp_path / "a.png").open("rb") as file, pytest.raises(InputError, match=r"must be an array, got <_io"):
            dloftbs.detect(file)

    def test_numbers_and_lists_are_not_like_arrays(self) -> None:
        assert [is_array_like(value) for value in (5, np.int64(5), [1], "x", None, dict)] == [False] * 6
        assert is_array_like(MASK)
        assert is_array_like(Picture("L", MASK))
