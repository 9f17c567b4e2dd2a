"""Image and mask files: one, a list, a folder, a glob."""

from __future__ import annotations

import glob
import os
import re
from collections import deque
from collections.abc import Iterable, Iterator, Sequence
from decimal import Decimal
from pathlib import Path

from dloftbs.camera import PinholeCamera
from dloftbs.errors import SourceError
from dloftbs.sources.image_header import AVIF_HEAD, is_avif_sequence, is_image
from dloftbs.sources.picture_stream import PictureStream
from dloftbs.sources.pixels import Kind, Picture, read_picture
from dloftbs.sources.source import logger
from dloftbs.support.overlap import in_order

IMAGE_EXTENSIONS = (".png", ".jpg", ".jpeg", ".bmp", ".tif", ".tiff", ".webp", ".avif", ".pbm", ".pgm", ".ppm")

_BEGIN_BYTES = 32
"""Bytes by which an image file is known."""

_TIME = re.compile(r"[0-9]{9,}\.[0-9]+")
_FILE_ADDRESS = re.compile(r"file:(?://(?:localhost)?)?(?P<path>/.*)", re.IGNORECASE | re.DOTALL)
_SEPARATOR = f"[{re.escape(os.sep + (os.altsep or ''))}]"


class FileSource(PictureStream):
    """Image files, a frame each, which has the name that `frame_names` gives.

    Parameters
    ----------
    paths : sequence of Path
        In the order of the stream.
    name : str
    kind : {"auto", "image", "mask"}
        Kind of the files; "auto" decides for each by its content.
    mask_is : {"auto", "binary", "probability", "labels"}
        What the values of masks are, as `Frame` has it.
    camera : PinholeCamera, optional
        Goes with every frame.
    fps : float, optional
        Gives the stamps ``index / fps``; without it there are none.
    jobs : int
        Files decoded at the same time, ahead of the frame that is asked for; with 1, each is when it is.
    upright : bool
        Turn pictures as their EXIF orientation says; otherwise they are as they were stored.
    """

    def __init__(
        self,
        paths: Sequence[Path],
        name: str,
        *,
        kind: Kind = "auto",
        mask_is: str = "auto",
        camera: PinholeCamera | None = None,
        fps: float | None = None,
        jobs: int = 1,
        upright: bool = False,
    ) -> None:
        super().__init__(name, frame_names(paths), mask_is=mask_is, camera=camera, fps=fps)
        self.paths = tuple(paths)
        self._kind = kind
        self._jobs = jobs
        self._upright = upright

    def _pictures(self) -> Iterator[Picture | SourceError]:
        if self._jobs == 1:
            return map(self._read, self.paths)
        return in_order(self._read, self.paths, self._jobs)

    def _read(self, path: Path) -> Picture | SourceError:
        try:
            return read_picture(path, self._kind, self._mask_is, upright=self._upright)
        except SourceError as error:
            return error


def frame_names(paths: Sequence[Path]) -> list[str]:
    """Return the names of files; where some share one, the paths of all below their common folder, with slashes."""
    names = [path.name for path in paths]
    if len(set(names)) == len(names):
        return names
    whole = [os.path.abspath(path) for path in paths]
    try:
        common = os.path.commonpath([os.path.dirname(path) for path in whole])
    except ValueError:  # two drives of Windows
        return [Path(path).as_posix() for path in whole]
    return [Path(os.path.relpath(path, common)).as_posix() for path in whole]


def check_place(path: Path, missing: str) -> None:
    """Refuse what is neither a file nor a folder: reading a pipe waits for its writer, and can be done only once.

    Raises
    ------
    SourceError
        If it is something else, or there is nothing, which `missing` says.
    """
    if not os.path.exists(path):
        raise SourceError(missing)
    if not (os.path.isfile(path) or os.path.isdir(path)):
        raise SourceError(f"{str(path)!r} is a pipe, a socket or a device, and no file; standard input is '-'")


def is_image_file(path: Path) -> bool:
    """Return whether a file is one image or an animation of them, by its name or by how it begins.

    An AVIF file of several images is a video.
    """
    try:
        with path.open("rb") as file:
            begin = file.read(AVIF_HEAD)
    except OSError:  # which comes again where it is read
        begin = b""
    return not is_avif_sequence(begin) and (path.suffix.lower() in IMAGE_EXTENSIONS or is_image(begin[:_BEGIN_BYTES]))


def natural_key(path: Path) -> tuple[list[tuple[int, str]], str]:
    """Return a key that sorts img2 before img10, and keeps the files of a folder together."""
    parts = re.split(r"([0-9]+)", path.as_posix().casefold().replace("/", "\0"))
    # Text and numbers alternate from text on, so that equal positions compare like with like.
    return [(int(part), "") if i % 2 else (0, part) for i, part in enumerate(parts)], path.as_posix()


def sorted_by_name(paths: Sequence[Path]) -> list[Path]:
    """Return files in natural order, those that are named by times in seconds in the order of the times.

    Such stems have a point, and at least nine digits before it: 1700000000.5 comes after 1700000000.05.
    """
    times = [_TIME.fullmatch(path.stem) for path in paths]
    if not all(times):
        return sorted(paths, key=natural_key)
    return sorted(paths, key=lambda path: (natural_key(path.parent), Decimal(path.stem), natural_key(path)))


def is_glob(text: str) -> bool:
    """Return whether the text is a pattern, and not the name of a file that happens to hold brackets."""
    return glob.has_magic(text) and not os.path.exists(text)


def list_files(where: str, extensions: Sequence[str]) -> list[Path]:
    """Return the files of a folder or a glob that end in one of the extensions, in natural order, without hidden ones.

    A ``**`` in a glob stands for any number of folders, links to folders included, each of them once. Links that
    lead to nothing are among the files: whoever reads them says so, and the files behind them keep their places.

    Raises
    ------
    SourceError
        If there is none, or the folder cannot be read.
    """
    if is_glob(where):
        found = [Path(match) for match in glob_matches(where)]
        if not found:
            raise SourceError(f"nothing matches the pattern {where!r}")
        what = f"the pattern {where!r} matches"
    else:
        try:
            found = list(Path(where).iterdir())
        except OSError as error:
            raise SourceError(f"the folder {where!r} cannot be read: {error.strerror or error}") from error
        what = f"the folder {where!r} holds"
    files = [p for p in found if p.suffix.lower() in extensions and not p.name.startswith(".") and _is_file(p)]
    if not files:
        raise SourceError(f"{what} no file that ends in {', '.join(extensions)}; found {len(found)} other entries")
    return sorted_by_name(files)


def without_scheme(where: str) -> str:
    """Return the path in an address of this machine, ``file:///a.mp4``; any other text as it is."""
    address = _FILE_ADDRESS.fullmatch(where)
    if address is None:
        return where
    from urllib.request import url2pathname  # late: it takes long

    return url2pathname(address["path"])


def _is_file(path: Path) -> bool:
    """Return whether a path is that of a file, or of a link that leads to nothing."""
    return os.path.isfile(path) or (os.path.islink(path) and not os.path.exists(path))


def files_of(where: str, extensions: Sequence[str]) -> list[Path]:
    """Return the files that a path, a folder or a glob stands for, without opening any.

    None where there is nothing, or no file: a camera or a stream.
    """
    path = Path(os.path.expanduser(without_scheme(where)))
    if os.path.isfile(path):  # which, unlike a Path's method, says no of a name that is too long
        return [path]
    if not (os.path.isdir(path) or is_glob(str(path))):
        return []
    try:
        return list_files(str(path), extensions)
    except SourceError:  # which comes again where it is opened
        return []


def glob_matches(pattern: str) -> list[str]:
    """Return what a glob matches; `glob.glob` itself goes round and round where links lead back to their folder."""
    if re.search(rf"(^|{_SEPARATOR})\*\*$", pattern):
        pattern = os.path.join(pattern, "*")
    first, *rest = re.split(rf"(?:^|(?<={_SEPARATOR}))(?:\*\*{_SEPARATOR}+)+", pattern)
    found = sorted(glob.glob(first)) if first else [""]
    for after in rest:
        folders = _folders_below(found)
        found = [match for folder in folders for match in sorted(glob.glob(os.path.join(glob.escape(folder), after)))]
    return found


def _folders_below(tops: Iterable[str]) -> list[str]:
    """Return the folders among the paths and all below them, without hidden ones, each once.

    One that links lead to as well goes by the name that it has without them.
    """
    folders: list[str] = []
    seen: set[tuple[int, int]] = set()
    waiting, linked = deque(tops), deque[str]()
    while waiting or linked:
        folder = waiting.popleft() if waiting else linked.popleft()
        if not os.path.isdir(folder or os.curdir):
            continue
        stat = os.stat(folder or os.curdir)
        if (stat.st_dev, stat.st_ino) in seen:
            continue
        seen.add((stat.st_dev, stat.st_ino))
        folders.append(folder)
        try:
            names = sorted(os.listdir(folder or os.curdir))
        except OSError as error:
            logger.warning("skipped the folder %s: %s", folder, error.strerror or error)
            continue
        for path in (os.path.join(folder, name) for name in names if not name.startswith(".")):
            (linked if os.path.islink(path) else waiting).append(path)
    return folders
