"""TIFF files of several pages: a stream in one file, as microscopes, ImageJ and tifffile write it."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import cast

from dloftbs.camera import PinholeCamera
from dloftbs.errors import SourceError, source_errors
from dloftbs.sources.picture_stream import PictureStream
from dloftbs.sources.pixel_values import as_depth
from dloftbs.sources.pixels import MAX_BYTES, Kind, Picture, decode, decode_picture, read_bytes
from dloftbs.sources.tiff_pages import Pages, is_tiff, pages_of, read_pages, select_page
from dloftbs.support.arrays import AnyArray

TIFF_EXTENSIONS = (".tif", ".tiff")


class PageSource(PictureStream):
    """The pages of a TIFF file, kept in memory as it is; smaller copies of pages are left out, lost ones skipped.

    Parameters
    ----------
    data : bytes
        Content of the file.
    pages : Pages
        As `pages_of` gives them.
    name : str
        For messages.
    label : str
        Name of the frames, before their number.
    kind, mask_is, camera, fps, upright
        As `FileSource` has them, for pages.
    """

    def __init__(
        self,
        data: bytes,
        pages: Pages,
        name: str,
        label: str,
        *,
        kind: Kind = "auto",
        mask_is: str = "auto",
        camera: PinholeCamera | None = None,
        fps: float | None = None,
        upright: bool = False,
    ) -> None:
        labels = [f"{label}#{index}" for index in range(len(pages.frames))]
        super().__init__(name, labels, mask_is=mask_is, camera=camera, fps=fps)
        self._file = bytearray(data)
        self._data = cast(bytes, self._file)  # which reads alike, and is not copied for every page
        self._pages = pages.frames
        self._cut = pages.cut
        self._kind = kind
        self._upright = upright

    def _pictures(self) -> Iterator[Picture | SourceError]:
        yield from map(self._read, range(len(self._pages)))
        if self._cut:
            self._skip(f"what follows page {len(self._pages) - 1} of {self.name}", "it is cut off or damaged")

    @property
    def count(self) -> int:
        """Number of pages."""
        return len(self._pages)

    def read_depth(self, index: int) -> AnyArray:
        """Return a page (H, W) that is depth.

        Raises
        ------
        SourceError
            If it cannot be decoded, or is no depth.
        """
        select_page(self._file, self._pages[index])
        with source_errors(f"{self.name}: page {index}"):
            return as_depth(decode(self._data))

    def read_mask(self, index: int) -> AnyArray:
        """Return a page (H, W) that is a mask, of a source whose kind is that.

        Raises
        ------
        SourceError
            If it cannot be decoded, or is no mask.
        """
        picture = self._read(index)
        if isinstance(picture, SourceError):
            raise picture
        assert picture.mask is not None  # the kind of the source
        return picture.mask

    def _read(self, index: int) -> Picture | SourceError:
        select_page(self._file, self._pages[index])
        try:
            return decode_picture(self._data, self._kind, self._mask_is, upright=self._upright)
        except SourceError as error:
            return SourceError(f"{self.name}: page {index}: {error}")


def open_pages(
    path: Path,
    *,
    kind: Kind = "auto",
    mask_is: str = "auto",
    camera: PinholeCamera | None = None,
    fps: float | None = None,
    upright: bool = False,
) -> PageSource | None:
    """Open a TIFF file as a stream of its pages; None where it has one page, or is none, or cannot be read.

    Raises
    ------
    SourceError
        If it has too many pages, or is too large.
    """
    if path.suffix.lower() not in TIFF_EXTENSIONS:
        return None
    with source_errors(path):
        if not _has_pages(path):
            return None
        data = read_bytes(path)
        pages = pages_of(data)
    return PageSource(
        data, pages, str(path), path.name, kind=kind, mask_is=mask_is, camera=camera, fps=fps, upright=upright
    )


def _has_pages(path: Path) -> bool:
    """Return whether a file is a TIFF of several frames, or was one before it was cut; its pixels are not read."""
    try:
        with path.open("rb") as file:

            def read(at: int, size: int) -> bytes:
                if at > MAX_BYTES:
                    return b""
                file.seek(at)
                return file.read(size)

            if not is_tiff(read(0, 16)):
                return False
            pages = read_pages(read)
            return len(pages.frames) > 1 or (len(pages.frames) == 1 and pages.cut)
    except SourceError:
        raise
    except OSError:  # which comes again where the image is read
        return False
