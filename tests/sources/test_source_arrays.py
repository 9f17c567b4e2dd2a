"""Arrays in memory, .npy and .npz: shapes, keys, corrupt files, memory."""

from __future__ import annotations

import struct
import tracemalloc
import zipfile

import cv2
import numpy as np
import pytest
from bounded import run_bounded

from dloftbs import sources
from dloftbs.camera import DepthRegistration, PinholeCamera
from dloftbs.errors import InputError, SourceError

RNG = np.random.default_rng(1)
IMAGES = RNG.integers(0, 256, (5, 8, 9, 3), dtype=np.uint8)
MASKS = RNG.integers(0, 2, (5, 8, 9), dtype=np.uint8)
DEPTH = RNG.uniform(0.5, 2.0, (5, 8, 9)).astype(np.float32)
CAMERA = PinholeCamera(100, 101, 4, 5)


def test_images():
    with sources.open(IMAGES, camera=CAMERA, fps=4) as source:
        assert (source.name, source.length, source.fps) == ("array", 5, 4)
        for index, frame in enumerate(source):
            np.testing.assert_array_equal(frame.image, IMAGES[index])
            assert np.shares_memory(frame.image, IMAGES)
            assert frame.mask is None
            assert (frame.index, frame.name, frame.stamp) == (index, f"array#{index}", index / 4)
            assert frame.camera is CAMERA
        assert index == 4
        assert len(list(source)) == 5


@pytest.mark.parametrize("dtype", [bool, np.uint8, np.int32])
def test_masks(dtype):
    with sources.open(MASKS.astype(dtype)) as source:
        frames = list(source)
    assert all(frame.image is None and frame.stamp is None for frame in frames)
    np.testing.assert_array_equal([frame.mask for frame in frames], MASKS)


def test_one_mask():
    for mask in (MASKS[0], MASKS[0][:, :, None]):
        with sources.open(mask) as source:
            (frame,) = source
        np.testing.assert_array_equal(frame.mask, MASKS[0])


SHAPES = [(5, 1, 8, 9), (5, 8, 9, 1)]
"""Of the same stacks, as networks put them out."""


@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize("kind", ["auto", "mask"])
def test_stacks_of_masks_with_an_axis_of_one(shape, kind):
    with sources.open(MASKS.reshape(shape), kind=kind) as source:
        np.testing.assert_array_equal([frame.mask for frame in source], MASKS)
    with sources.open(MASKS.reshape(shape), kind="image") as source:
        np.testing.assert_array_equal(next(iter(source)).image, np.dstack([MASKS[0]] * 3))


@pytest.mark.parametrize("shape", SHAPES)
def test_files_of_stacks_with_an_axis_of_one(shape, tmp_path):
    stacks = {key: value.reshape(shape) for key, value in (("masks", MASKS), ("depth", DEPTH), ("occluders", MASKS))}
    np.savez(tmp_path / "a.npz", **stacks, images=IMAGES)
    np.save(tmp_path / "masks.npy", stacks["masks"])
    np.save(tmp_path / "images.npy", IMAGES)
    with sources.open(tmp_path / "a.npz") as source:
        frames = list(source)
    for name, expected in (("image", IMAGES), ("mask", MASKS), ("depth", DEPTH), ("occluders", MASKS)):
        np.testing.assert_array_equal([getattr(frame, name) for frame in frames], expected)
    with sources.open(tmp_path / "masks.npy") as source:
        np.testing.assert_array_equal([frame.mask for frame in source], MASKS)
    with sources.open(tmp_path / "images.npy", masks=tmp_path / "masks.npy", depth=tmp_path / "a.npz") as source:
        frames = list(source)
    np.testing.assert_array_equal([frame.mask for frame in frames], MASKS)
    np.testing.assert_array_equal([frame.depth for frame in frames], DEPTH)


@pytest.mark.parametrize("shape", SHAPES)
def test_depth_with_an_axis_of_one_is_registered(shape):
    camera = PinholeCamera(100, 100, 4, 4, size=(8, 9))
    registration = DepthRegistration(camera, camera, np.eye(3), np.zeros(3))
    source = sources.ArraySource("a", masks=MASKS, depth=DEPTH.reshape(shape), registration=registration)
    np.testing.assert_allclose([frame.depth for frame in source], DEPTH, rtol=1e-6)


@pytest.mark.parametrize("shape", [(1, 8, 9), (8, 9, 1)])
def test_files_of_one_frame_with_an_axis_of_one(shape, tmp_path):
    for i in range(2):
        np.save(tmp_path / f"{i}_mask.npy", MASKS[i].reshape(shape))
        np.save(tmp_path / f"{i}_depth.npy", DEPTH[i].reshape(shape))
        cv2.imwrite(str(tmp_path / f"{i}.png"), IMAGES[i])
    with sources.open(tmp_path / "?.png", masks="{stem}_mask.npy", depth="{stem}_depth.npy") as source:
        frames = list(source)
    np.testing.assert_array_equal([frame.mask for frame in frames], MASKS[:2])
    np.testing.assert_array_equal([frame.depth for frame in frames], DEPTH[:2])


def test_kind_overrules_the_shape():
    with sources.open(IMAGES, kind="mask") as source:
        np.testing.assert_array_equal(next(iter(source)).mask != 0, (IMAGES[0] != 0).any(axis=2))
    with sources.open(MASKS, kind="image") as source:
        np.testing.assert_array_equal(next(iter(source)).image, np.dstack([MASKS[0]] * 3))


@pytest.mark.parametrize("dtype", [np.float16, np.float32, np.float64])
def test_a_stack_of_probabilities_is_one_of_masks(dtype):
    stack = np.linspace(0.0, 1.0, 5 * 8 * 9).reshape(5, 8, 9).astype(dtype)
    with sources.open(stack) as source:
        frames = list(source)
    assert {frame.mask_is for frame in frames} == {"probability"}
    np.testing.assert_array_equal(np.stack([frame.mask for frame in frames]), np.rint(255.0 * stack).astype(np.uint8))


@pytest.mark.parametrize(
    ("array", "kind", "message"),
    [
        (IMAGES[0], "auto", r"\(N, H, W, 3\), got \(8, 9, 3\).*array\[None\]"),
        (IMAGES.astype(np.float32), "auto", r"uint8.*float32; scale them first: \(255 \* images\)"),
        (IMAGES.transpose(0, 3, 1, 2), "auto", r"channels come last: images\.transpose\(0, 2, 3, 1\)"),
        (IMAGES[..., [0, 1, 2, 2]], "auto", r"four channels: images\[\.\.\., :3\] if they are BGRA"),
        (IMAGES[..., :2], "auto", r"\(5, 8, 9, 2\)"),
        (DEPTH, "auto", r"mask must be a probability in 0\.\.1 where it is floating point, got .*; of scores, give"),
        (MASKS[:0], "auto", "at least one frame"),
        (np.zeros(4), "auto", r"\(4,\)"),
        (MASKS.astype(bool), "image", "uint8.*bool"),
    ],
)
def test_wrong_arrays(array, kind, message):
    with pytest.raises(InputError, match=message):
        sources.open(array, kind=kind)


def test_npy(tmp_path):
    np.save(tmp_path / "a.npy", IMAGES)
    with sources.open(tmp_path / "a.npy") as source:
        assert (source.name, source.length) == ("a.npy", 5)
        frames = list(source)
        assert frames[3].name == "a.npy#3"
        np.testing.assert_array_equal(frames[3].image, IMAGES[3])
        base = frames[3].image
        while isinstance(base.base, np.ndarray):
            base = base.base
        assert isinstance(base, np.memmap)


@pytest.mark.parametrize("save", [np.savez, np.savez_compressed])
def test_npz(tmp_path, save):
    stamps = np.array([0.0, 0.1, 0.3, 0.4, 0.9])
    save(
        tmp_path / "a.npz",
        images=IMAGES, masks=MASKS, depth=DEPTH, occluders=MASKS[::-1], instances=MASKS // 3, stamps=stamps,
        camera=[100, 101, 4, 5], more=["ignored"],
    )  # fmt: skip
    with sources.open(tmp_path / "a.npz") as source:
        for _ in range(2):  # it can be read again
            frames = list(source)
            np.testing.assert_array_equal([frame.image for frame in frames], IMAGES)
            np.testing.assert_array_equal([frame.mask for frame in frames], MASKS)
            np.testing.assert_array_equal([frame.depth for frame in frames], DEPTH)
            np.testing.assert_array_equal([frame.occluders for frame in frames], MASKS[::-1])
            np.testing.assert_array_equal([frame.instances for frame in frames], MASKS // 3)
            assert [frame.stamp for frame in frames] == stamps.tolist()
            assert frames[0].camera == CAMERA


@pytest.mark.parametrize(
    ("stamps", "expected"),
    [
        ([0.0, 0.0, 1.0, 1.0, 1.0], [0.0, 0.5, 1.0, 1.5, 2.0]),
        ([0.0, 0.1, 0.1, 0.5, 0.6], [0.0, 0.1, 0.3, 0.5, 0.6]),
        ([9.0, 9.0, 1.0, 3.0, 4.0], [9.0, 10.5, 1.0, 3.0, 4.0]),
        (np.array([5.0] * 5), [None] * 5),
    ],
)
def test_different_frames_that_share_a_stamp_are_spread(tmp_path, caplog, stamps, expected):
    np.savez(tmp_path / "a.npz", images=IMAGES, stamps=stamps)
    with sources.open(tmp_path / "a.npz") as source:
        assert [frame.stamp for frame in source] == pytest.approx(expected)
    (record,) = caplog.records
    assert "differs from the one before it and has the same stamp" in record.getMessage()


def test_repeated_frames_share_a_stamp(tmp_path, caplog):
    np.savez(tmp_path / "a.npz", images=IMAGES[[0, 0, 1, 1, 2]], stamps=[0.0, 0.0, 1.0, 1.0, 2.0])
    with sources.open(tmp_path / "a.npz") as source:
        assert [frame.stamp for frame in source] == [0.0, 0.0, 1.0, 1.0, 2.0]
    assert not caplog.records


def test_explicit_arguments_come_first(tmp_path):
    np.savez(tmp_path / "a.npz", images=IMAGES, masks=MASKS, stamps=np.zeros(5), camera=[1, 1, 1, 1])
    with sources.open(tmp_path / "a.npz", camera=CAMERA, fps=2, kind="image") as source:
        frame = list(source)[1]
    assert (frame.camera, frame.stamp, frame.mask) == (CAMERA, 0.5, None)
    with sources.open(tmp_path / "a.npz", kind="mask") as source:
        frame = next(iter(source))
    assert frame.image is None
    np.testing.assert_array_equal(frame.mask, MASKS[0])


def test_a_colour_makes_images_of_grey_arrays_alone(tmp_path):
    np.savez(tmp_path / "a.npz", images=IMAGES, masks=MASKS)
    np.savez(tmp_path / "masks.npz", masks=MASKS)
    for stack in (tmp_path / "a.npz", tmp_path / "masks.npz", MASKS != 0):
        with sources.open(stack, kind="auto_image") as source:
            np.testing.assert_array_equal(next(iter(source)).mask != 0, MASKS[0] != 0)
    with sources.open(MASKS, kind="auto_image") as source:
        frame = next(iter(source))
    assert frame.mask is None
    np.testing.assert_array_equal(frame.image, np.dstack([MASKS[0]] * 3))


@pytest.mark.parametrize("read", ["read", "abandoned"])
def test_npz_is_streamed(tmp_path, read):
    images = np.zeros((64, 240, 320, 3), np.uint8)
    images[:, 5] = np.arange(64)[:, None, None]
    np.savez_compressed(tmp_path / "a.npz", images=images)
    size = images.nbytes
    del images
    tracemalloc.start()
    try:
        with sources.open(tmp_path / "a.npz") as source:
            for frame in source:
                assert frame.image[5, 0, 0] == frame.index
                if read == "abandoned":
                    break
            assert frame.index == (0 if read == "abandoned" else 63)
        assert tracemalloc.get_traced_memory()[1] < size / 8
    finally:
        tracemalloc.stop()


def test_npz_without_frames(tmp_path):
    np.savez(tmp_path / "a.npz", picture=IMAGES, depth=DEPTH)
    with pytest.raises(SourceError, match=r"a\.npz.*found picture, depth; expected images \(N, H, W, 3\) uint8; masks"):
        sources.open(tmp_path / "a.npz")


@pytest.mark.parametrize(
    ("arrays", "message"),
    [
        ({"images": IMAGES, "masks": MASKS[:4]}, r"agree.*'images': \(5, 8, 9\), 'masks': \(4, 8, 9\)"),
        ({"masks": MASKS, "depth": DEPTH[:, :5]}, "agree"),
        ({"masks": MASKS, "occluders": MASKS[:, :5]}, "agree"),
        ({"masks": MASKS, "instances": MASKS[:, :5]}, "agree"),
        ({"masks": MASKS, "instances": DEPTH / 3.0}, "instances must have shape"),
        ({"masks": MASKS, "occluders": DEPTH / 3.0}, "occluders must have shape"),
        ({"masks": MASKS, "depth": DEPTH.astype(np.uint8)}, "depth must have shape .* of uint8; 8 bits are .* picture"),
        ({"masks": MASKS, "depth": DEPTH > 0}, "depth must have shape .* of bool$"),
        ({"masks": MASKS, "stamps": [0.0, 1.0]}, r"stamps must be 5 finite numbers, got \(2,\)"),
        ({"masks": MASKS, "stamps": [0, 1, 2, 3, np.nan]}, "finite"),
        ({"masks": MASKS, "camera": [1.0, 2.0]}, r"fx, fy, cx, cy, got \(2,\)"),
        ({"masks": MASKS, "camera": [-1.0, 2.0, 3.0, 4.0]}, "positive"),
        ({"masks": np.array([None])}, "Python objects"),
        ({"masks": np.asfortranarray(MASKS)}, "Fortran order.*ascontiguousarray"),
        ({"masks": np.float32(1)}, r"\(N, H, W\)"),
    ],
)
def test_wrong_npz(tmp_path, arrays, message):
    np.savez(tmp_path / "a.npz", **arrays)
    with pytest.raises(SourceError, match=r"(?s)a\.npz.*" + message):
        sources.open(tmp_path / "a.npz")


@pytest.mark.parametrize("extension", ["npy", "npz"])
@pytest.mark.parametrize("share", [0.0, 0.1, 0.9])
def test_cut_off_file(tmp_path, extension, share):
    path = tmp_path / f"a.{extension}"
    np.save(path, MASKS) if extension == "npy" else np.savez(path, masks=MASKS)
    data = path.read_bytes()
    path.write_bytes(data[: int(share * len(data))])
    with pytest.raises(SourceError, match=rf"a\.{extension}: cannot be read as a \.{extension} file"):
        sources.open(path)


@pytest.mark.parametrize("save", [np.savez, np.savez_compressed])
def test_npz_damaged_within(tmp_path, save):
    noise = np.random.default_rng(2).integers(0, 256, (5, 64, 64), dtype=np.uint8)
    save(tmp_path / "a.npz", masks=noise)
    data = bytearray((tmp_path / "a.npz").read_bytes())
    data[9000:9010] = bytes(10)
    (tmp_path / "a.npz").write_bytes(data)
    with sources.open(tmp_path / "a.npz") as source, pytest.raises(SourceError, match="'masks' cannot be read"):
        list(source)


def test_npz_with_a_member_that_is_no_array(tmp_path):
    with zipfile.ZipFile(tmp_path / "a.npz", "w") as archive:
        archive.writestr("masks.npy", "no array")
    with pytest.raises(SourceError, match=r"a\.npz: the array 'masks' cannot be read"):
        sources.open(tmp_path / "a.npz")


def test_depth_alone_is_no_source():
    with pytest.raises(InputError, match="images, masks or instances must be given"):
        sources.ArraySource("x", depth=DEPTH)


def test_pickles_are_refused(tmp_path):
    np.save(tmp_path / "a.npy", np.array([{"a": 1}], dtype=object))
    with pytest.raises(SourceError, match="cannot be read"):
        sources.open(tmp_path / "a.npy")


def test_names_that_lie(tmp_path):
    np.savez(tmp_path / "a.npz", masks=MASKS)
    (tmp_path / "a.npz").rename(tmp_path / "a.npy")
    with pytest.raises(SourceError, match=r"name it \.npz"):
        sources.open(tmp_path / "a.npy")
    np.save(tmp_path / "b.npy", MASKS)
    (tmp_path / "b.npy").rename(tmp_path / "b.npz")
    with pytest.raises(SourceError, match=r"b\.npz: cannot be read as a \.npz file"):
        sources.open(tmp_path / "b.npz")


def test_closing_ends_the_iteration(tmp_path):
    np.savez(tmp_path / "a.npz", masks=MASKS)
    source = sources.open(tmp_path / "a.npz")
    frames = iter(source)
    next(frames)
    source.close()
    assert list(frames) == []
    with pytest.raises(SourceError, match="closed"):
        iter(source)


def npy(descr: str, shape: str, values: bytes = b"", order: str = "False", version: int = 1) -> bytes:
    """Return a .npy file whose header says whatever it is to say."""
    text = f"{{'descr': {descr}, 'fortran_order': {order}, 'shape': {shape}, }}\n".encode()
    return b"\x93NUMPY" + bytes([version, 0]) + struct.pack("<H" if version == 1 else "<I", len(text)) + text + values


LYING = {
    "negative": npy("'|u1'", "(-1, 10, 10)", bytes(100)),
    "twice negative": npy("'|u1'", "(1, -10, -10)", bytes(100)),
    "true": npy("'|u1'", "(True, 4, 4)", bytes(16)),
    "floating": npy("'|u1'", "(1.0, 4, 4)", bytes(16)),
    "more than there is": npy("'|u1'", "(100000000000, 4, 4)", bytes(16)),
    "beyond int64": npy("'|u1'", f"({10**30}, 0, 4)"),
    "overflowing": npy("'|u1'", f"({2**32}, {2**31}, 2)", bytes(16)),
    "objects": npy("'|O'", "(1, 4, 4)", b"cos\nsystem\n(S'true'\ntR."),
    "no type": npy("'?what'", "(1, 4, 4)", bytes(16)),
    "giant type": npy("('|u1', (1000000000, 1000000000))", "(1, 4, 4)", bytes(16)),
    "text": npy("'|u1'", "'abc'", bytes(16)),
    "deprecated type": npy("'a8'", "(1, 4, 4)", bytes(128)),
    "python 2": npy("'|u1'", "(1L, 4L, 4L)", bytes(16)),
    "no order": npy("'|u1'", "(1, 4, 4)", bytes(16), order="3"),
    "unclosed": npy("'|u1'", "(1, 4, 4", bytes(16)),
    "deep": npy("'|u1'", "-" * 9000 + "1", bytes(16)),
    "brackets": npy("'|u1'", "(" * 4000 + ")" * 4000, bytes(16)),
    "other keys": b"\x93NUMPY\x01\x00\x02\x00{}",
    "long header": b"\x93NUMPY\x02\x00\xff\xff\xff\x7f" + bytes(1000),
    "unknown version": npy("'|u1'", "(1, 4, 4)", bytes(16), version=9),
    "no header": b"\x93NUMPY",
}


@pytest.mark.parametrize("name", LYING)
@pytest.mark.parametrize("key", ["masks", "depth", "stamps", "camera", "distortion_model"])
def test_a_member_whose_header_lies_is_refused(tmp_path, name, key):
    path = tmp_path / "a.npz"
    np.savez_compressed(path, **({} if key == "masks" else {"masks": MASKS}))
    with zipfile.ZipFile(path, "a", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr(f"{key}.npy", LYING[name])
    with pytest.raises(SourceError, match=r"a\.npz: .*cannot be read"):
        sources.open(path)


@pytest.mark.parametrize("name", LYING)
def test_a_file_whose_header_lies_is_refused(tmp_path, name):
    (tmp_path / "a.npy").write_bytes(LYING[name])
    with pytest.raises(SourceError, match=r"a\.npy: cannot be read"):
        sources.open(tmp_path / "a.npy")
    np.save(tmp_path / "masks.npy", MASKS)
    with pytest.raises(SourceError, match=r"a\.npy: cannot be read"):
        sources.open(tmp_path / "masks.npy", depth=tmp_path / "a.npy")


BOMBS = """
import sys
for path in sys.argv[1:]:
    try:
        with sources.open(path) as source:
            list(source)
    except SourceError as error:
        print(str(error).replace(path, "")[:200])
"""


def test_an_archive_that_unpacks_to_gigabytes_is_refused(tmp_path):
    paths = [tmp_path / f"{name}.npz" for name in ("frame", "stamps", "header", "bzip2")]
    side = 20_000
    contents = [
        ("masks", npy("'|u1'", f"(1, {side}, {side})"), side * side),
        ("stamps", npy("'<f8'", "(50000000,)"), 400_000_000),
        ("masks", b"\x93NUMPY\x02\x00\x00\x00\x00\x18", 400_000_000),
        ("masks", npy("'|u1'", "(9, 100, 100)"), 90_000),
    ]
    for path, (key, head, zeros) in zip(paths, contents, strict=True):
        how = zipfile.ZIP_BZIP2 if path.stem == "bzip2" else zipfile.ZIP_DEFLATED
        with zipfile.ZipFile(path, "w", how, compresslevel=1) as archive, archive.open(f"{key}.npy", "w") as member:
            member.write(head)
            for start in range(0, zeros, 1 << 20):
                member.write(bytes(min(1 << 20, zeros - start)))
        if key == "stamps":
            with zipfile.ZipFile(path, "a") as archive:
                archive.writestr("masks.npy", npy("'|u1'", "(5, 8, 9)", bytes(360)))
    first = "import numpy.lib.format, cv2\nfrom dloftbs import sources\nfrom dloftbs.errors import SourceError"
    said = run_bounded(BOMBS, *paths, first=first, extra_bytes=200 << 20).splitlines()
    assert len(said) == 4, said
    assert "at most 134217728 pixels" in said[0]
    assert "cannot be read" in said[1]
    assert "cannot be read" in said[2]
    assert "cannot be read" in said[3]


@pytest.mark.parametrize(("more", "kind"), [({}, "auto"), ({"images": IMAGES}, "auto"), ({"depth": DEPTH}, "mask")])
def test_instances_make_the_masks(tmp_path, more, kind):
    np.savez(tmp_path / "a.npz", instances=MASKS, **more)
    with sources.open(tmp_path / "a.npz", kind=kind) as source:
        frames = list(source)
    np.testing.assert_array_equal([frame.instances for frame in frames], MASKS)
    np.testing.assert_array_equal([frame.mask for frame in frames], MASKS != 0)
    assert all((frame.image is not None) == ("images" in more) for frame in frames)
    assert all((frame.depth is not None) == ("depth" in more) for frame in frames)


@pytest.mark.parametrize("form", ["array", "npy", "npz"])
def test_floating_point_masks_are_what_is_said_of_them(tmp_path, form):
    stack = MASKS.astype(np.float32) * 0.3
    np.save(tmp_path / "a.npy", stack)
    np.savez(tmp_path / "a.npz", masks=stack)
    where = stack if form == "array" else tmp_path / f"a.{form}"
    for mask_is, expected in (("auto", MASKS > 1), ("probability", MASKS > 1), ("binary", MASKS > 0)):
        with sources.open(where, mask_is=mask_is) as source:
            np.testing.assert_array_equal([frame.is_cable for frame in source], expected)
