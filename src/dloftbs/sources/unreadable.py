"""Names of what OpenCV does not decode, so that a message says more than that a file is corrupt."""

from __future__ import annotations

import struct
from pathlib import Path

from dloftbs.errors import SourceError
from dloftbs.sources.image_header import FORMATS, JPEG, jpeg_frame, read_size
from dloftbs.sources.tiff_pages import BITS, COMPRESSION, DNG_VERSION, SAMPLE_FORMAT, first_page, is_tiff

_BEGIN_BYTES = 32
"""Bytes by which a format is known."""
MAX_TIFF_BYTES = 1 << 30
"""Of a TIFF, whose tags may stand at its end; as `pixels.MAX_BYTES`."""
_PICTURE = "save it as PNG"
_DEPTH = "save it as PNG of 16 bits, TIFF of float32 or .npy"
_BEGINS = {
    b"\xff\x0a": ("JPEG XL", _PICTURE),
    b"\0\0\0\x0cJXL ": ("JPEG XL", _PICTURE),
    b"\0\0\0\x0cjP  ": ("JPEG 2000", _PICTURE),
    b"\xff\x4f\xff\x51": ("JPEG 2000", _PICTURE),
    b"\x76\x2f\x31\x01": ("OpenEXR", _DEPTH),
    b"#?RADIANCE": ("Radiance HDR", _DEPTH),
    b"8BPS": ("Photoshop", _PICTURE),
    b"gimp xcf": ("GIMP", _PICTURE),
    b"%PDF": ("PDF", _PICTURE),
    b"DDS ": ("DirectDraw", _PICTURE),
    b"qoif": ("QOI", _PICTURE),
    b"FUJIFILMCCD-RAW": ("a camera's raw data (RAF)", _PICTURE),
    b"IIRO": ("a camera's raw data (ORF)", _PICTURE),
    b"IIU\0": ("a camera's raw data (RW2)", _PICTURE),
}
"""Formats of pictures by how their files begin, with what to do."""
_BRANDS = {
    **dict.fromkeys((b"heic", b"heix", b"heim", b"heis", b"hevc", b"hevx", b"mif1", b"msf1"), "HEIC"),
    b"crx ": "a camera's raw data (CR3)",
}
"""Formats of pictures by the brand of their container, which films share."""
_CANON_RAW = b"CR\x02"
_COMPRESSIONS = {
    **{6: "JPEG in the way of TIFF 6.0", 9: "JBIG", 10: "JBIG", 32809: "ThunderScan", 32908: "PIXAR"},
    **{32909: "PIXAR", 34661: "JBIG", 34676: "SGI LogLuv", 34677: "SGI LogLuv", 34712: "JPEG 2000"},
    **{33003: "JPEG 2000", 33004: "JPEG 2000", 33005: "JPEG 2000", 34887: "LERC", 34892: "lossy JPEG of a DNG"},
    **{34925: "LZMA", 34926: "zstd", 34927: "WebP", 50000: "zstd", 50001: "WebP", 50002: "JPEG XL", 52546: "JPEG XL"},
}
"""Compressions of TIFF that OpenCV's wheels leave out, all or some, as libtiff numbers them."""
_READ_EVERYWHERE = (1, 2, 3, 4, 5, 7, 8, 32771, 32773, 32946)
"""None, those of fax, LZW, JPEG, deflate, PackBits: compressions of TIFF in all builds of OpenCV."""
_SOMETIMES_READ = (6, 32766, 32809, 32909, 34661, 34676, 34677, 34887, 34925, 50000, 50001)
"""Compressions of TIFF that libtiff reads or refuses, as it was built. Of all others OpenCV makes black pixels."""
_FLOATING, _BYTES = 3, 8
_BITS = (1, 4, 8, 10, 12, 14, 16, 24, 32, 64)
"""Bits of a value in a TIFF that OpenCV reads; 24 is for floating point, which is named by itself."""
_JPEG_PROCESSES = {
    **dict.fromkeys((0xC3, 0xC7, 0xCB, 0xCF), "lossless"),
    **dict.fromkeys((0xC5, 0xC6, 0xCD, 0xCE), "hierarchical"),
    **dict.fromkeys((0xC9, 0xCA), "arithmetic"),
}
"""Processes of coding in a JPEG that most decoders leave out, by the marker of the frame."""


def name_format(data: bytes) -> tuple[str, str] | None:
    """Return the name of a format of pictures that is not read, and what to do; None where nothing is known.

    Of a TIFF, the whole file is needed; of others 32 bytes.
    """
    if data[4:8] == b"ftyp":
        name = None if b"avif" in data[8:32] else _BRANDS.get(bytes(data[8:12]))
        return None if name is None else (name, _PICTURE)
    if is_tiff(data):
        page = first_page(data)
        if data[8:11] == _CANON_RAW or (page is not None and DNG_VERSION in page.tags):
            return "a camera's raw data (DNG, CR2)", f"develop it, and {_PICTURE}"
        return None
    return next((named for begin, named in _BEGINS.items() if data.startswith(begin)), None)


def check_format(path: Path) -> None:
    """Refuse a file that is a picture, and of no format that is read.

    Raises
    ------
    SourceError
        If it is one.
    """
    try:
        with path.open("rb") as file:
            begin = file.read(_BEGIN_BYTES)
            named = name_format(begin + file.read(MAX_TIFF_BYTES) if is_tiff(begin) else begin)
    except OSError:  # which comes again where it is read
        return
    if named is not None:
        raise SourceError(f"{path}: it is {named[0]}, which is not read; {named[1]}")


def why_unreadable(data: bytes) -> str:
    """Say why an image file is not decoded, as far as its header shows."""
    named = name_format(data)
    if named is not None:
        return f"it is {named[0]}, which is not read; {named[1]}"
    damaged = "corrupt or cut off" if read_size(data) else f"no {FORMATS}, or are cut off"
    begin = bytes(data[:_BEGIN_BYTES])
    if begin.startswith(b"GIF8") or begin[4:8] == b"ftyp":
        return f"it is a GIF, an AVIF or a video, no {FORMATS}; give it its own ending"
    return _why_tiff(data) or _why_jpeg(data) or f"its {len(data)} bytes are {damaged}"


def is_refused(data: bytes) -> bool:
    """Return whether an image file must not be decoded: OpenCV would make up its pixels, or take a preview for it."""
    page = first_page(data) if is_tiff(data) else None
    compression = 1 if page is None else page.tags.get(COMPRESSION, 1)
    return name_format(data) is not None or compression not in (*_READ_EVERYWHERE, *_SOMETIMES_READ)


def _why_tiff(data: bytes) -> str | None:
    page = first_page(data) if is_tiff(data) else None
    if page is None:
        return None
    compression, bits = page.tags.get(COMPRESSION, 1), page.tags.get(BITS, 1)
    if compression not in _READ_EVERYWHERE:
        name = _COMPRESSIONS.get(compression, "an unknown method")
        return (
            f"it is a TIFF compressed by {name} (number {compression}), which this OpenCV does not read; save it with "
            "LZW, deflate or no compression"
        )
    if bits not in _BITS:
        return f"it is a TIFF of {bits} bits a value, which this OpenCV does not read; save it with 8 or 16"
    if page.tags.get(SAMPLE_FORMAT) == _FLOATING and bits not in (32, 64):
        return f"it is a TIFF of floating point of {bits} bits, and 32 or 64 are read; save it as float32"
    return None


def _why_jpeg(data: bytes) -> str | None:
    try:
        frame = jpeg_frame(data) if data.startswith(JPEG) else None
        if frame is None:
            return None
        marker, at = frame
        bits = data[at]
    except (struct.error, IndexError):
        return None
    process = _JPEG_PROCESSES.get(marker)
    if process is None and bits == _BYTES:
        return None
    kind = f"{process} JPEG" if process else "JPEG"
    return f"it is a {kind} of {bits} bits, which this OpenCV does not read; save it as PNG or as JPEG of 8 bits"
