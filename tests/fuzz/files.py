"""Files that lie, that were cut off, or that somebody wrote to do harm."""

from __future__ import annotations

import io
import json
import struct
import zipfile
import zlib
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import cv2
import numpy as np

from dloftbs import Config, DepthRegistration, Frame, PinholeCamera, Pipeline, sinks, sources
from dloftbs_lab import KnownSequence, open_labelled, write_sequence
from dloftbs_lab.truth import Truth
from fuzz import masks
from fuzz.checks import own

Rng = np.random.Generator


@dataclass(frozen=True)
class File:
    """A file of any content."""

    name: str
    content: bytes

    def written(self, folder: Path) -> Path:
        path = folder / self.name
        path.write_bytes(self.content)
        return path


def broken(rng: Rng, content: bytes) -> bytes:
    """Cut off, flip bits, repeat, leave out, put something in."""
    data = bytearray(content)
    for _ in range(int(rng.integers(1, 5))):
        if not data:
            break
        at, reach = int(rng.integers(len(data))), int(rng.integers(1, 40))
        kind = int(rng.integers(6))
        if kind == 0:
            del data[at:]
        elif kind == 1:
            for _ in range(int(rng.integers(1, 12))):
                where = int(rng.integers(len(data)))
                data[where] ^= 1 << int(rng.integers(8))
        elif kind == 2:
            del data[at : at + reach]
        elif kind == 3:
            data[at:at] = data[at : at + reach]
        elif kind == 4:
            data[at:at] = rng.integers(0, 256, reach).astype(np.uint8).tobytes()
        else:
            where = int(rng.integers(min(64, len(data))))  # headers are where files are trusted
            data[where] = int(rng.choice([0, 1, 127, 128, 255]))
    return bytes(data)


ROS = """image_width: 640
image_height: 480
camera_name: left
camera_matrix: {rows: 3, cols: 3, data: [600.0, 0, 320.5, 0, 600.0, 240.5, 0, 0, 1]}
distortion_model: plumb_bob
distortion_coefficients: {rows: 1, cols: 5, data: [0.1, -0.2, 0.001, 0.0, 0.0]}
"""
OPENCV = """%YAML:1.0
---
image_width: 640
image_height: 480
camera_matrix: !!opencv-matrix
   rows: 3
   cols: 3
   dt: d
   data: [ 600., 0., 320., 0., 600., 240., 0., 0., 1. ]
distortion_coefficients: !!opencv-matrix
   rows: 5
   cols: 1
   dt: d
   data: [ 0.1, -0.2, 0.001, 0., 0. ]
"""
OPENCV_XML = """<?xml version="1.0"?>
<opencv_storage>
<image_width>640</image_width><image_height>480</image_height>
<camera_matrix type_id="opencv-matrix"><rows>3</rows><cols>3</cols><dt>d</dt>
<data>600. 0. 320. 0. 600. 240. 0. 0. 1.</data></camera_matrix>
<distortion_coefficients type_id="opencv-matrix"><rows>1</rows><cols>4</cols><dt>d</dt>
<data>0.1 -0.2 0. 0.</data></distortion_coefficients>
</opencv_storage>
"""
KALIBR = """cam0:
  camera_model: pinhole
  intrinsics: [600.0, 600.0, 320.0, 240.0]
  distortion_coeffs: [0.1, 0.0, 0.0, 0.0]
  distortion_model: equidistant
  resolution: [640, 480]
"""
OPEN3D = json.dumps({"width": 640, "height": 480, "intrinsic_matrix": [600, 0, 0, 0, 600, 0, 320, 240, 1]})
REALSENSE = json.dumps(
    {"fx": 600, "fy": 600, "ppx": 320, "ppy": 240, "coeffs": [0] * 5, "model": "inverse_brown_conrady", "width": 640}
)
PLAIN = json.dumps(PinholeCamera(600.0, 600.0, 320.0, 240.0, (0.1, 0.0, 0.0, 0.0)).to_dict())
REGISTRATION = json.dumps(
    {
        "depth_camera": {"fx": 600, "fy": 600, "cx": 320, "cy": 240},
        "colour_camera": {"fx": 600, "fy": 600, "cx": 320, "cy": 240},
        "rotation": [1, 0, 0, 0, 1, 0, 0, 0, 1],
        "translation_m": [0.01, 0, 0],
    }
)
CALIBRATIONS = (ROS, OPENCV, OPENCV_XML, KALIBR, OPEN3D, REALSENSE, PLAIN, REGISTRATION)
_HARMFUL = (
    *(
        "-1",
        "1e400",
        "9" * 400,
        "!!float abc",
        "!!int x",
        "!!timestamp 5",
        "2001-99-99",
        "!!binary x",
        "!!python/none x",
    ),
    *(
        ".nan",
        "-.inf",
        "[]",
        "{}",
        "null",
        "*a",
        "&a [*a]",
        "true",
        '"',
        "!!opencv-matrix",
        "\t",
        "\x00",
        "0x",
        "1:60:60",
    ),
    *("<<: *a", "? [a]", "- - - -", "%TAG ! x", "[" * 300, "{a: " * 300, "<a>" * 300, "&lol;", "1_0", "!!set {a}"),
)


def calibration(rng: Rng) -> File:
    """A calibration of which some values, or bytes, are others."""
    text = CALIBRATIONS[int(rng.integers(len(CALIBRATIONS)))]
    suffix = ".xml" if text is OPENCV_XML else str(rng.choice([".yaml", ".json", ".yml"]))
    for _ in range(int(rng.integers(0, 4))):
        words = [i for i, sign in enumerate(text) if sign.isdigit()] or [0]
        at = words[int(rng.integers(len(words)))]
        text = text[:at] + _HARMFUL[int(rng.integers(len(_HARMFUL)))] + text[at + 1 :]
    content = text.encode()
    return File(f"camera{suffix}", broken(rng, content) if rng.random() < 0.5 else content)


def _bomb(levels: int = 40) -> str:
    lines = ["a0: &a0 [1, 1, 1, 1, 1, 1, 1, 1, 1]"]
    lines += [f"a{i}: &a{i} [{', '.join([f'*a{i - 1}'] * 9)}]" for i in range(1, levels)]
    return "\n".join([*lines, f"K: *a{levels - 1}"])


def _laughs() -> str:
    entities = "".join(f'<!ENTITY l{i} "{f"&l{i - 1};" * 10}">' for i in range(1, 12))
    return (
        f'<?xml version="1.0"?><!DOCTYPE x [<!ENTITY l0 "lol">{entities}]><opencv_storage><K>&l11;</K></opencv_storage>'
    )


_CALIBRATIONS_FOUND = {
    "cols: -1": ("camera.yaml", OPENCV.replace("cols: 3", "cols: -1")),
    "cols: -1 in XML": ("camera.xml", OPENCV_XML.replace("<cols>3", "<cols>-1")),
    "rows by the billion": ("camera.yaml", OPENCV.replace("rows: 3", "rows: 2000000000")),
    "50,000 deep for OpenCV": ("camera.yaml", "%YAML:1.0\n---\nK: " + "[" * 50_000),
    "50,000 deep": ("camera.yaml", "K: " + "[" * 50_000),
    "20,000 deep and closed": ("camera.yaml", "K: " + "[" * 20_000 + "]" * 20_000),
    "50,000 deep in JSON": ("camera.json", '{"K": ' + "[" * 50_000),
    "20,000 mappings": ("camera.json", '{"K": ' * 20_000 + "1" + "}" * 20_000),
    "indented 2,000 deep": ("camera.yaml", "\n".join("  " * i + "a:" for i in range(2_000))),
    "deep in XML": ("camera.xml", "<opencv_storage>" + "<a>" * 50_000),
    "a bomb of aliases": ("camera.yaml", _bomb()),
    "a bomb of merges": ("camera.yaml", "a: &a {k: 1}\nb: &b {<<: [" + ", ".join(["*a"] * 50_000) + "]}\n"),
    "entities": ("camera.xml", _laughs()),
    "a self-reference": ("camera.yaml", "K: &a [*a]"),
    "a mapping of itself": ("camera.yaml", "&a {K: *a, D: *a}"),
    "!!float abc": ("camera.yaml", ROS.replace("600.0", "!!float abc")),
    "!!timestamp 5": ("camera.yaml", ROS.replace("600.0", "!!timestamp 5")),
    "2001-99-99": ("camera.yaml", ROS.replace("600.0", "2001-99-99")),
    "an integer of 400 digits": ("camera.yaml", ROS.replace("640", "9" * 400)),
    "an integer of 10,000 digits": ("camera.yaml", ROS.replace("640", "9" * 10_000)),
    "an integer of 10,000 digits in JSON": ("camera.json", PLAIN.replace("600.0", "9" * 10_000)),
    "a set for a key": ("camera.yaml", "? [a, b]\n: 1\n"),
    "no UTF-8": ("camera.yaml", b"\xff\xfe\xfd".decode("latin1")),
    "nothing": ("camera.yaml", ""),
}
CALIBRATIONS_FOUND = {name: File(path, text.encode("latin1")) for name, (path, text) in _CALIBRATIONS_FOUND.items()}


def check_calibration(case: File, folder: Path) -> None:
    """Check all that is read from YAML, JSON and XML."""
    path = case.written(folder)
    own(lambda: PinholeCamera.from_file(path))
    own(lambda: DepthRegistration.from_file(path))
    own(lambda: Config.from_file(path))
    own(lambda: sources.open(np.zeros((1, 480, 640), np.uint8), camera=path))


@cache
def _picture() -> tuple[np.ndarray, np.ndarray]:
    mask = masks.tangle(np.random.default_rng(6), (60, 80))
    image = np.random.default_rng(7).integers(0, 255, (60, 80, 3)).astype(np.uint8)
    image[mask > 0] = (0, 0, 255)
    return image, mask


_EXIF_TURNED = b"\xff\xe1\x00\x22Exif\0\0MM\0\x2a\0\0\0\x08\0\x01\x01\x12\0\x03\0\0\0\x01\0\x03\0\0" + bytes(4)
"""Segment of a JPEG that turns it by 180 degrees."""


@cache
def _encoded() -> tuple[tuple[str, bytes], ...]:
    image, mask = _picture()
    depth = (mask.astype(np.uint16) * 700) + 3
    made = []
    for suffix in (".png", ".jpg", ".bmp", ".tif", ".webp"):
        for pixels in (image, 255 * mask):
            made.append((suffix, cv2.imencode(suffix, pixels)[1].tobytes()))
    made.append((".png", cv2.imencode(".png", depth)[1].tobytes()))
    made.append((".tif", cv2.imencode(".tif", depth.astype(np.float32))[1].tobytes()))
    made += [(".tif", cv2.imencodemulti(".tif", pages)[1].tobytes()) for pages in ([mask * 255] * 3, [depth] * 3)]
    made += [
        (suffix, cv2.imencode(suffix, np.dstack([image, mask]))[1].tobytes()) for suffix in (".png", ".tif", ".webp")
    ]
    jpeg = cv2.imencode(".jpg", image)[1].tobytes()
    made.append((".jpg", jpeg[:2] + _EXIF_TURNED + jpeg[2:]))
    return tuple(made)


def image_file(rng: Rng) -> File:
    """An image file that is cut off or has wrong bits."""
    suffix, content = _encoded()[int(rng.integers(len(_encoded())))]
    return File(f"frame{suffix}", broken(rng, content) if rng.random() < 0.9 else content)


def _chunk(kind: bytes, data: bytes) -> bytes:
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))


def _png(width: int, height: int, bits: int = 8, colours: int = 2) -> bytes:
    header = struct.pack(">IIBBBBB", width, height, bits, colours, 0, 0, 0)
    return (
        b"\x89PNG\r\n\x1a\n"
        + _chunk(b"IHDR", header)
        + _chunk(b"IDAT", zlib.compress(b"\0" * 1000))
        + _chunk(b"IEND", b"")
    )


def _bmp(width: int, height: int) -> bytes:
    return (
        b"BM"
        + struct.pack("<IHHI", 200, 0, 0, 54)
        + struct.pack("<IiiHHIIiiII", 40, width, height, 1, 24, *[0] * 6)
        + b"\0" * 99
    )


def _jpeg(width: int, height: int) -> bytes:
    content = bytearray(cv2.imencode(".jpg", np.zeros((16, 16, 3), np.uint8))[1].tobytes())
    at = content.index(b"\xff\xc0") + 5
    content[at : at + 4] = struct.pack(">HH", height, width)
    return bytes(content)


IMAGES_FOUND = {
    "a PNG of 30,000 x 30,000": File("frame.png", _png(30_000, 30_000)),
    "a PNG of 2 ** 31 - 1": File("frame.png", _png(2**31 - 1, 2**31 - 1, 16, 6)),
    "a PNG of a line": File("frame.png", _png(2**30 - 1, 1)),
    "a PNG of nothing": File("frame.png", _png(0, 0)),
    "a BMP of 30,000 x 30,000": File("frame.bmp", _bmp(30_000, 30_000)),
    "a BMP upside down": File("frame.bmp", _bmp(100, -(2**31))),
    "a JPEG of 65,000 x 65,000": File("frame.jpg", _jpeg(65_000, 65_000)),
    "an empty file": File("frame.png", b""),
}


def check_image(case: File, folder: Path) -> None:
    """Check an image file as image, mask and depth, and beside others in a folder."""
    path = case.written(folder)
    frames: list[Frame] = []
    for kind in ("auto", "image", "mask"):
        own(lambda kind=kind: frames.extend(sources.open(path, kind=kind)))
    _, mask = _picture()
    cv2.imwrite(str(folder / "whole.png"), 255 * mask)
    own(lambda: frames.extend(sources.open(folder, kind="mask", jobs=2)))
    own(lambda: frames.extend(sources.open(folder / "whole.png", depth=str(path))))
    own(lambda: frames.extend(sources.open(folder / "whole.png", kind="image", masks=str(path))))
    pipeline = Pipeline()
    for frame in frames:
        if frame.mask is not None:
            own(lambda frame=frame: pipeline.process(frame))


_CODECS = {
    "mp4": "libx264",
    "mov": "libx264",
    "matroska": "libx264",
    "mpegts": "libx264",
    "webm": "libvpx",
    "avi": "mjpeg",
}
"""Containers by FFmpeg's names, with a codec each."""


@cache
def video_bytes(container: str = "mp4") -> bytes:
    import av

    buffer, (image, _) = io.BytesIO(), _picture()
    with av.open(buffer, "w", format=container) as output:
        stream = output.add_stream(_CODECS[container], rate=30)
        stream.width, stream.height = 80, 60
        stream.pix_fmt = "yuvj420p" if container == "avi" else "yuv420p"
        for shift in range(8):
            frame = av.VideoFrame.from_ndarray(np.roll(image, shift, 1), format="bgr24")
            output.mux(stream.encode(frame))
        output.mux(stream.encode())
    return buffer.getvalue()


def video_file(rng: Rng) -> File:
    """A video that is cut off or has wrong bits."""
    content = video_bytes(str(rng.choice(list(_CODECS))))
    suffix = str(rng.choice([".mp4", ".mov", ".mkv", ".avi", ".ts"]))  # readers go by the content
    return File(f"cable{suffix}", broken(rng, content) if rng.random() < 0.95 else content)


def check_video(case: File, folder: Path) -> None:
    """Check that a video gives what can be read of it, the same each time, with times that do not go back."""
    path = case.written(folder)
    found: list[list[tuple[object, ...]]] = []

    def read() -> None:
        with sources.open(path) as source:
            found.append([])
            for frame in source:
                assert frame.image is not None
                found[-1].append((frame.index, frame.stamp, frame.image.tobytes()))

    own(read)
    own(read)
    assert found[1:] == found[:-1]
    for frames in found:
        indices, stamps = [frame[0] for frame in frames], [frame[1] for frame in frames if frame[1] is not None]
        assert indices == sorted(set(indices))
        assert stamps == sorted(stamps)
        assert np.isfinite(stamps).all()


def _npy(header: str, body: bytes = b"\0" * 400) -> bytes:
    text = header.encode() + b" " * (-(len(header) + 11) % 64) + b"\n"
    return b"\x93NUMPY\x01\x00" + struct.pack("<H", len(text)) + text + body


def _zipped(**members: bytes) -> bytes:
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w") as archive:
        for name, content in members.items():
            archive.writestr(f"{name}.npy", content)
    return buffer.getvalue()


def _saved(array: np.ndarray) -> bytes:
    buffer = io.BytesIO()
    np.save(buffer, array)
    return buffer.getvalue()


def _archive(rng: Rng) -> bytes:
    _, mask = _picture()
    members: dict[str, Any] = {"masks": np.stack([mask] * 3)}
    if rng.random() < 0.5:
        members["depth"] = np.full((3, 60, 80), 0.7, np.float32)
        members["camera"] = np.array([100.0, 100.0, 40.0, 30.0])
    if rng.random() < 0.5:
        members["stamps"] = np.arange(3) / 30
    if rng.random() < 0.3:  # an array of something else under a name that is known
        key = str(rng.choice(["images", "masks", "depth", "stamps", "camera", "distortion", "distortion_model"]))
        members[key] = rng.choice(np.array([0.0, np.nan, 1e300]), tuple(rng.integers(0, 4, int(rng.integers(0, 4)))))
    content = {name: _saved(array) for name, array in members.items()}
    if rng.random() < 0.5:  # the archive is whole, one of its arrays is not
        name = str(rng.choice(list(content)))
        content[name] = broken(rng, content[name])
    return _zipped(**content)


def stack_file(rng: Rng) -> File:
    """A .npy or a .npz file with something wrong."""
    if rng.random() < 0.4:
        content = _saved(np.stack([_picture()[1]] * 2))
        return File("masks.npy", broken(rng, content))
    content = _archive(rng)
    return File("frames.npz", broken(rng, content) if rng.random() < 0.5 else content)


def _header(shape: str, descr: str = "|u1", fortran: str = "False") -> bytes:
    return _npy(f"{{'descr': '{descr}', 'fortran_order': {fortran}, 'shape': {shape}, }}")


def _named_at_length(length: int) -> bytes:
    """An archive in which the header before its array says that the name goes on through the pixels."""
    content = bytearray(_zipped(masks=_saved(np.zeros((2, 200, 200), np.uint8))))
    content[26:28] = length.to_bytes(2, "little")
    return bytes(content)


_HEADERS = {
    "a shape of -1": _header("(-1, 10, 10)"),
    "a shape of True": _header("(True, 4, 4)"),
    "a shape of 10 ** 11": _header("(100000000000,)", "<f8"),
    "a shape of 10 ** 30": _header(f"({10**30}, 4, 4)"),
    "a shape that overflows": _header("(4294967296, 4294967296, 4294967296)"),
    "a shape of no size": _header("(100000000000, 0, 4)"),
    "a huge frame": _header("(1, 100000, 1000000)"),
    "a shape of floats": _header("(1.0, 4, 4)"),
    "fortran order": _header("(4, 10, 10)", "|u1", "True"),
    "objects": _header("(4, 10, 10)", "|O"),
    "a type of no size": _header("(4, 10, 10)", "|V0"),
    "text": _header("(4, 10, 10)", "<U1"),
    "a header of brackets": _npy("(" * 5000),
    "a header that is no header": _npy("__import__('os')"),
}
STACKS_FOUND = {
    **{f"{name}, npy": File("masks.npy", content) for name, content in _HEADERS.items()},
    **{f"{name}, npz": File("f.npz", _zipped(masks=content)) for name, content in _HEADERS.items()},
    **{
        f"stamps of {name}": File("f.npz", _zipped(masks=_saved(np.zeros((2, 8, 8), np.uint8)), stamps=content))
        for name, content in _HEADERS.items()
    },
    "a member's name of 60,000 characters": File("f.npz", _named_at_length(60_000)),
}


def check_stack(case: File, folder: Path) -> None:
    """Check a stack as frames, as depth beside frames, and as a result."""
    path = case.written(folder)
    frames: list[Frame] = []

    def read(where: Any, **options: Any) -> Callable[[], None]:
        def reading() -> None:
            with sources.open(where, **options) as source:
                for frame, _ in zip(source, range(5), strict=False):
                    frames.append(frame)

        return reading

    own(read(path))
    own(read(path, kind="mask", fps=30.0))
    _, mask = _picture()
    cv2.imwrite(str(folder / "whole.png"), 255 * mask)
    own(read(folder / "whole.png", depth=str(path)))
    own(read(folder / "whole.png", kind="image", masks=str(path)))
    pipeline = Pipeline()
    for frame in frames:
        if frame.mask is not None:
            own(lambda frame=frame: pipeline.process(frame))
    own(lambda: list(sinks.read_npz(path)))


@cache
def _lines() -> bytes:
    pipeline, (_, mask) = Pipeline(), _picture()
    results = [pipeline.process(Frame(mask=np.roll(mask, i, 0), index=i)) for i in range(3)]
    return "".join(json.dumps(result.to_dict()) + "\n" for result in results).encode()


def lines_file(rng: Rng) -> File:
    """JSON lines of results with something wrong."""
    return File("curves.jsonl", broken(rng, _lines()) if rng.random() < 0.9 else _lines())


LINES_FOUND = {
    "no UTF-8": File("curves.jsonl", b'{"name": "\xff\xfe"}\n'),
    "deep": File("curves.jsonl", b"[" * 100_000 + b"\n"),
    "digits": File("curves.jsonl", b'{"index": ' + b"9" * 10_000 + b"}\n"),
    "numbers": File("curves.jsonl", b"1\n2\n"),
    "zeros": File("curves.jsonl", b"\0" * 1000),
    "a line without end": File("curves.jsonl", b'{"index": 0'),
}


def check_lines(case: File, folder: Path) -> None:
    """Check results that are read back, and labelled folders with such a file in them."""
    path = case.written(folder)
    own(lambda: list(sinks.read_json_lines(path)))
    image, _ = _picture()
    for suffix in (".json", ".csv"):
        labelled = folder / f"labelled{suffix}"
        labelled.mkdir()
        cv2.imwrite(str(labelled / "000.png"), image)
        (labelled / f"000{suffix}").write_bytes(case.content)
        own(lambda labelled=labelled: _read_labelled(labelled))
    written = folder / "written"
    write_sequence(_Few(), written)
    _read_labelled(written)
    for found in [written / "sequence.json", written / "truth.jsonl"]:
        before = found.read_bytes()
        for content in (case.content, before[: len(before) // 2] + case.content + before[len(before) // 2 :]):
            found.write_bytes(content)
            own(lambda: _read_labelled(written))
        found.write_bytes(before)


class _Few(KnownSequence):
    """Two frames with their truth."""

    name, fps, length = "few", 30.0, 2

    def frame(self, index: int) -> Frame:
        image, mask = _picture()
        return Frame(image=image, mask=mask, index=index, stamp=index / 30)

    def truth(self, index: int) -> Truth:
        return Truth((Pipeline().detect(self.frame(index)).detections[0].curve,), (), (1,))


def _read_labelled(folder: Path) -> None:
    known = open_labelled(folder)
    for index in range(len(known)):
        known.frame(index)
        known.truth(index)
