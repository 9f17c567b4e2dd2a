"""Standard input as a source: an image, an animation or an array, told apart by its content."""

from __future__ import annotations

import io
from types import SimpleNamespace

import cv2
import numpy as np
import pytest

from dloftbs import sources
from dloftbs.camera import PinholeCamera
from dloftbs.errors import InputError, SourceError
from dloftbs.sources import standard_input

COLOUR = np.zeros((12, 16, 3), np.uint8)
COLOUR[4:6, 2:14] = (10, 200, 30)
MASK = COLOUR[..., 1]


@pytest.fixture
def pipe(monkeypatch):
    """Put bytes on standard input."""

    def put(data: bytes) -> None:
        monkeypatch.setattr("sys.stdin", io.TextIOWrapper(io.BytesIO(data)))

    return put


def encoded(suffix: str, pixels: np.ndarray = COLOUR) -> bytes:
    done, data = cv2.imencode(suffix, pixels)
    assert done
    return bytes(data)


def arrays(**named: np.ndarray) -> bytes:
    stream = io.BytesIO()
    np.savez_compressed(stream, **named)
    return stream.getvalue()


def array(values: np.ndarray) -> bytes:
    stream = io.BytesIO()
    np.save(stream, values)
    return stream.getvalue()


@pytest.mark.parametrize("suffix", [".png", ".jpg", ".bmp", ".tif", ".webp", ".ppm"])
def test_an_image_by_its_content(pipe, suffix):
    data = encoded(suffix)
    pipe(data)
    camera = PinholeCamera(500, 500, 8, 6)
    with sources.open("-", camera=camera, fps=5) as source:
        assert (source.name, source.length, source.fps) == ("standard input", 1, 5)
        (frame,) = source
        (again,) = source  # it is in memory
    np.testing.assert_array_equal(frame.image, cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_COLOR))
    np.testing.assert_array_equal(frame.image, again.image)
    assert (frame.index, frame.stamp, frame.name, frame.camera) == (0, 0.0, "stdin", camera)


def test_a_mask_and_its_kind(pipe):
    pipe(encoded(".png", MASK))
    with sources.open("-") as source:
        np.testing.assert_array_equal(next(iter(source)).mask, MASK)
    pipe(encoded(".png", MASK))
    with sources.open("-", kind="image") as source:
        assert next(iter(source)).image is not None
    ringing = encoded(".jpg", np.kron(MASK, np.ones((4, 4), np.uint8)))
    pipe(ringing)
    with sources.open("-", kind="mask") as source:
        assert next(iter(source)).mask.dtype == bool


def test_arrays(pipe):
    stack = np.stack([MASK, MASK[::-1]])
    for data in (array(stack), array(np.asfortranarray(stack)), arrays(masks=stack, stamps=[0.0, 0.5])):
        pipe(data)
        with sources.open("-") as source:
            assert source.length == 2
            for _ in range(2):
                for frame, expected in zip(source, stack, strict=True):
                    np.testing.assert_array_equal(frame.mask, expected)
                    assert frame.name == f"stdin#{frame.index}"


def test_an_animation(pipe):
    image = pytest.importorskip("PIL.Image")
    if not hasattr(cv2, "imdecodeanimation"):
        pytest.skip("needs OpenCV 4.11")
    stream = io.BytesIO()
    frames = [image.fromarray(np.roll(COLOUR, number, axis=0)) for number in range(3)]
    frames[0].save(stream, "WEBP", save_all=True, append_images=frames[1:], lossless=True, duration=100)
    pipe(stream.getvalue())
    with sources.open("-") as source:
        assert [(frame.name, frame.stamp) for frame in source] == [("stdin#0", 0.0), ("stdin#1", 0.1), ("stdin#2", 0.2)]


def test_depth_goes_with_it(pipe, tmp_path):
    np.save(tmp_path / "depth.npy", np.ones((12, 16), np.float32))
    pipe(encoded(".png"))
    with sources.open("-", depth=tmp_path / "depth.npy") as source:
        assert next(iter(source)).depth.shape == (12, 16)
    pipe(encoded(".png"))
    with pytest.raises(InputError, match=r"naming rule.* needs colour frames in files"):
        sources.open("-", depth="{stem}_depth.png")


@pytest.mark.parametrize(
    ("data", "message"),
    [
        (b"", "standard input is empty, or was read before"),
        (b"hello\n", "must hold an image file .*, or a .npz or .npy file; its 6 bytes are none"),
        (encoded(".png")[:20], "its 20 bytes are none, or are cut off"),
        (bytes(5000), "A video is to be given by its path"),
        (arrays(masks=MASK[None])[:100], "its 100 bytes are none, or are cut off"),
        (arrays(other=MASK), "stdin: needs the array 'images', 'masks' or 'instances'; found other"),
        (array(MASK)[:140], "stdin: cannot be read as a .npy file: it is cut off"),
        (array(np.zeros(3)), "stdin: "),
    ],
    ids=["empty", "text", "cut image", "zeros", "cut archive", "other arrays", "cut array", "no stack"],
)
def test_what_is_none_of_these_is_an_error(pipe, data, message):
    pipe(data)
    with pytest.raises(SourceError, match=message):
        sources.open("-")


def test_an_image_that_is_cut_off_names_its_source(pipe):
    pipe(encoded(".png")[:-20])
    with sources.open("-") as source, pytest.raises(SourceError, match="standard input: cannot be decoded"):
        list(source)


def test_a_terminal_is_not_waited_for(monkeypatch):
    def read(size: int) -> bytes:
        raise AssertionError("a terminal is not read")

    terminal = SimpleNamespace(isatty=lambda: True, read=read)
    monkeypatch.setattr("sys.stdin", SimpleNamespace(buffer=terminal))
    with pytest.raises(SourceError, match=r"standard input is a terminal; send an image file .* through a pipe"):
        sources.open("-")


def test_a_closed_stream_is_an_error(monkeypatch):
    monkeypatch.setattr("sys.stdin", None)
    with pytest.raises(SourceError, match="standard input is closed"):
        sources.open("-")
    monkeypatch.setattr("sys.stdin", SimpleNamespace(buffer=io.BytesIO()))
    standard_input.sys.stdin.buffer.close()
    with pytest.raises(SourceError, match="standard input cannot be read"):
        sources.open("-")


def test_no_more_is_read_than_a_file_may_have(monkeypatch):
    asked = []

    def read(size: int) -> bytes:
        asked.append(size)
        return encoded(".png") + bytes(size - len(encoded(".png")))

    monkeypatch.setattr(standard_input, "MAX_BYTES", 1000)
    monkeypatch.setattr("sys.stdin", SimpleNamespace(buffer=SimpleNamespace(isatty=lambda: False, read=read)))
    with pytest.raises(SourceError, match="must have at most 1000 bytes"):
        sources.open("-")
    assert asked == [1001]


def test_a_file_of_that_name_has_a_folder_before_it(tmp_path, monkeypatch, pipe):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "-").write_bytes(encoded(".png"))
    pipe(encoded(".png", MASK))
    with sources.open("-") as source:
        assert next(iter(source)).mask is not None
