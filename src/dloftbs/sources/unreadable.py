"""Pictures that are not read, so that a message says more than that a file is corrupt."""

from __future__ import annotations

from pathlib import Path

from dloftbs.errors import SourceError
from dloftbs.sources.image_header import FORMATS
from dloftbs.sources.tiff_pages import COMPRESSION, DNG_VERSION, first_page, is_tiff

_BEGIN_BYTES = 32
"""Bytes by which a format is known."""
_BEGINS = {
    b"\xff\x0a": "JPEG XL",
    b"\0\0\0\x0cJXL ": "JPEG XL",
    b"\0\0\0\x0cjP  ": "JPEG 2000",
    b"\x76\x2f\x31\x01": "OpenEXR",
    b"#?RADIANCE": "Radiance HDR",
    b"8BPS": "Photoshop",
    b"%PDF": "PDF",
}
"""Formats of pictures by how their files begin."""
_BRANDS = (b"heic", b"heix", b"heim", b"heis", b"hevc", b"hevx", b"mif1", b"msf1")
"""Of HEIC, whose container is that of films: a decoder of videos gives a tile of the picture."""
_COMPRESSIONS = (
    *(1, 2, 3, 4, 5, 6, 7, 8, 32766, 32771, 32773, 32809, 32909, 32946),
    *(34661, 34676, 34677, 34887, 34925, 50000, 50001),
)
"""Compressions of TIFF that libtiff reads or refuses, as it was built. Of all others OpenCV makes black pixels."""


def name_format(data: bytes) -> str | None:
    """Return the name of a format of pictures that is not read; None where nothing is known."""
    if data[4:8] == b"ftyp":
        return "HEIC" if data[8:12] in _BRANDS else None
    return next((name for begin, name in _BEGINS.items() if data.startswith(begin)), None)


def check_format(path: Path) -> None:
    """Refuse a file that is a picture, and of no format that is read.

    Raises
    ------
    SourceError
        If it is one.
    """
    try:
        with path.open("rb") as file:
            name = name_format(file.read(_BEGIN_BYTES))
    except OSError:  # which comes again where it is read
        return
    if name is not None:
        raise SourceError(f"{path}: it is {name}, which is not read; save it as PNG")


def why_unreadable(data: bytes) -> str:
    """Say why an image file is not decoded."""
    name = name_format(data)
    if name is not None:
        return f"it is {name}, which is not read; save it as PNG"
    return f"its {len(data)} bytes are corrupt or cut off, or no {FORMATS} that this OpenCV reads"


def is_refused(data: bytes) -> bool:
    """Return whether a TIFF must not be decoded: OpenCV would make up its pixels, or take a preview for it."""
    page = first_page(data) if is_tiff(data) else None
    return page is not None and (DNG_VERSION in page.tags or page.tags.get(COMPRESSION, 1) not in _COMPRESSIONS)
