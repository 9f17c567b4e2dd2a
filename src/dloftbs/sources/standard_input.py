"""Standard input as a source: an image, an animation, or an array, distinguished by its content."""

from __future__ import annotations

import sys
import zipfile
from collections.abc import Iterator

from dloftbs.camera import DepthRegistration, PinholeCamera
from dloftbs.errors import SourceError
from dloftbs.sources.animations import AnimationSource
from dloftbs.sources.image_header import FORMATS, is_avif_sequence, read_durations, read_size
from dloftbs.sources.picture_stream import PictureStream
from dloftbs.sources.pixels import MAX_BYTES, Kind, Picture, decode_picture
from dloftbs.sources.source import Source
from dloftbs.sources.stacks import from_file
from dloftbs.sources.tiff_pages import pages_of
from dloftbs.sources.tiff_stack import PageSource
from dloftbs.sources.unreadable import name_format
from dloftbs.support.npy import InMemory, is_npy, opened
from dloftbs.support.values import MILLIMETRE_M

STANDARD_INPUT = "-"
_NAME = "standard input"
_LABEL = "stdin"
"""Name of the frames, and of what is named after them."""
_EXPECTED = f"an image file ({FORMATS}), or a .npz or .npy file"


class ImageSource(PictureStream):
    """One image that was read into memory.

    Parameters
    ----------
    data : bytes
        Content of the image file.
    kind, mask_is, camera, fps, upright
        As `FileSource` has them.
    """

    def __init__(
        self,
        data: bytes,
        *,
        kind: Kind,
        mask_is: str,
        camera: PinholeCamera | None,
        fps: float | None,
        upright: bool = False,
    ) -> None:
        super().__init__(_NAME, [_LABEL], mask_is=mask_is, camera=camera, fps=fps)
        self._data = data
        self._kind = kind
        self._upright = upright

    def _pictures(self) -> Iterator[Picture]:
        try:
            yield decode_picture(self._data, self._kind, self._mask_is, upright=self._upright)
        except SourceError as error:
            raise SourceError(f"{self.name}: {error}") from error


def open_standard_input(
    kind: Kind,
    mask_is: str,
    camera: PinholeCamera | None,
    fps: float | None,
    registration: DepthRegistration | None = None,
    depth_unit_m: float = MILLIMETRE_M,
    upright: bool = False,
) -> Source:
    """Read all of standard input into memory, and open it as the file that it is.

    Raises
    ------
    SourceError
        If it is a terminal, empty, longer than image files may be, or of no format that is known.
    """
    data = _read()
    if len(read_durations(data)) > 1:
        return AnimationSource(data, _NAME, _LABEL, kind=kind, mask_is=mask_is, camera=camera, fps=fps)
    pages = pages_of(data)
    if len(pages.frames) > 1:
        return PageSource(
            data, pages, _NAME, _LABEL, kind=kind, mask_is=mask_is, camera=camera, fps=fps, upright=upright
        )
    if read_size(data) is not None and not is_avif_sequence(data):
        return ImageSource(data, kind=kind, mask_is=mask_is, camera=camera, fps=fps, upright=upright)
    file = InMemory(_LABEL, data)
    if is_npy(data) or zipfile.is_zipfile(opened(file)):
        return from_file(file, kind, mask_is, camera, fps, registration, depth_unit_m)
    named = name_format(data)
    if named is not None:
        raise SourceError(f"{_NAME} must hold {_EXPECTED}; it is {named[0]}, which is not read; {named[1]}")
    raise SourceError(
        f"{_NAME} must hold {_EXPECTED}; its {len(data)} bytes are none, or are cut off. "
        "A video is to be given by its path"
    )


def _read() -> bytes:
    stream = getattr(sys.stdin, "buffer", None)
    if stream is None:
        raise SourceError(f"{_NAME} is closed, or gives text alone; it must hold {_EXPECTED}")
    try:
        if stream.isatty():
            raise SourceError(f"{_NAME} is a terminal; send {_EXPECTED} through a pipe, or give a path")
        data: bytes = stream.read(MAX_BYTES + 1)
    except SourceError:
        raise
    except (OSError, ValueError) as error:  # a ValueError where it was closed
        raise SourceError(f"{_NAME} cannot be read: {error}") from error
    if not data:
        raise SourceError(f"{_NAME} is empty, or was read before; it must hold {_EXPECTED}")
    if len(data) > MAX_BYTES:
        raise SourceError(f"{_NAME} must have at most {MAX_BYTES} bytes; give larger files by their path")
    return data
