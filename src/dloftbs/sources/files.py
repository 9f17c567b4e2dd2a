"""Image and mask files: one, a list, a folder, a glob."""

from __future__ import annotations

import glob
import re
from collections.abc import Iterable, Iterator, Sequence
from contextlib import closing
from pathlib import Path

from dloftbs.camera import PinholeCamera
from dloftbs.errors import SourceError
from dloftbs.frame import Frame
from dloftbs.overlap import in_order
from dloftbs.sources.base import Source
from dloftbs.sources.pixels import AnyArray, Kind, read_image_or_mask

IMAGE_EXTENSIONS = (".png", ".jpg", ".jpeg", ".bmp", ".tif", ".tiff", ".webp", ".pbm", ".pgm", ".ppm")

_Read = tuple[AnyArray | None, AnyArray | None]


class FileSource(Source):
    """Image files, a frame each.

    Parameters
    ----------
    paths : sequence of Path
        In the order of the stream.
    name : str
    kind : {"auto", "image", "mask"}
        What the files hold; "auto" decides for each by its content.
    camera : PinholeCamera, optional
        Goes with every frame.
    fps : float, optional
        Gives the stamps ``index / fps``; without it there are none.
    jobs : int
        Files decoded at the same time, ahead of the frame that is asked for; with 1, each is when it is.
    """

    def __init__(
        self,
        paths: Sequence[Path],
        name: str,
        *,
        kind: Kind = "auto",
        camera: PinholeCamera | None = None,
        fps: float | None = None,
        jobs: int = 1,
    ) -> None:
        self.paths = tuple(paths)
        self.name = name
        self.fps = fps
        self.length = len(self.paths)
        self._kind = kind
        self._camera = camera
        self._jobs = jobs

    def __iter__(self) -> Iterator[Frame]:
        """Yield the frames, read one by one; what cannot be read is skipped.

        Raises
        ------
        SourceError
            If the source is closed, or its only file cannot be read.
        """
        self._begin()
        return self._frames()

    def _frames(self) -> Iterator[Frame]:
        if self._jobs == 1:
            yield from self._made(map(self._read, self.paths))
            return
        with closing(in_order(self._read, self.paths, self._jobs)) as reads:
            yield from self._made(reads)

    def _made(self, reads: Iterable[_Read | SourceError]) -> Iterator[Frame]:
        for index, (path, read) in enumerate(zip(self.paths, reads, strict=True)):
            if isinstance(read, SourceError):
                if self.length == 1:
                    raise read
                self._skip(f"frame {index}", read)
                continue
            image, mask = read
            stamp = None if self.fps is None else index / self.fps
            yield Frame(image=image, mask=mask, camera=self._camera, index=index, stamp=stamp, name=path.name)
            if self._closed:
                return

    def _read(self, path: Path) -> _Read | SourceError:
        try:
            return read_image_or_mask(path, self._kind)
        except SourceError as error:
            return error


def natural_key(path: Path) -> tuple[list[tuple[int, str]], str]:
    """Return a key that sorts img2 before img10, and keeps the files of a folder together."""
    parts = re.split(r"([0-9]+)", path.as_posix().casefold().replace("/", "\0"))
    # Text and numbers alternate from text on, so that equal positions compare like with like.
    return [(int(part), "") if i % 2 else (0, part) for i, part in enumerate(parts)], path.as_posix()


def is_glob(text: str) -> bool:
    """Whether the text is a pattern, and not the name of a file that happens to hold brackets."""
    return glob.has_magic(text) and not Path(text).exists()


def list_files(where: str, extensions: Sequence[str]) -> list[Path]:
    """Return the files of a folder or a glob that end in one of the extensions, in natural order, without hidden ones.

    Raises
    ------
    SourceError
        If there is none, or the folder cannot be read.
    """
    if is_glob(where):
        found = [Path(match) for match in glob.glob(where, recursive=True)]
        if not found:
            raise SourceError(f"nothing matches the pattern {where!r}")
        what = f"the pattern {where!r} matches"
    else:
        try:
            found = list(Path(where).iterdir())
        except OSError as error:
            raise SourceError(f"the folder {where!r} cannot be read: {error.strerror or error}") from error
        what = f"the folder {where!r} holds"
    files = [p for p in found if p.suffix.lower() in extensions and not p.name.startswith(".") and p.is_file()]
    if not files:
        raise SourceError(f"{what} no file that ends in {', '.join(extensions)}; found {len(found)} other entries")
    return sorted(files, key=natural_key)
