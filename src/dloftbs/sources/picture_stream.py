"""Streams of pictures that are decoded one by one, each from an image file or a page of one."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Iterator, Sequence

from dloftbs.camera import PinholeCamera
from dloftbs.data.frame import Frame
from dloftbs.errors import SourceError
from dloftbs.sources.orientation import AS_STORED, MEANINGS
from dloftbs.sources.pixels import Picture
from dloftbs.sources.source import ReadSource, logger


class PictureStream(ReadSource):
    """Pictures, a frame each; what cannot be decoded is skipped, unless there is no other.

    A subclass gives `_pictures`. The first frame of another size than those before is reported: tracks begin anew.

    Parameters
    ----------
    name : str
    labels : sequence of str
        Names of the frames.
    mask_is, camera, fps
        As `FileSource` has them.
    """

    def __init__(
        self,
        name: str,
        labels: Sequence[str],
        *,
        mask_is: str = "auto",
        camera: PinholeCamera | None = None,
        fps: float | None = None,
    ) -> None:
        self.name = name
        self.fps = fps
        self.length = len(labels)
        self._labels = labels
        self._mask_is = mask_is
        self._camera = camera

    @abstractmethod
    def _pictures(self) -> Iterator[Picture | SourceError]:
        """Yield what each frame is made of, or why it cannot be decoded."""

    def _frames(self) -> Iterator[Frame]:
        names: dict[tuple[int, int], str] = {}  # of the first frame of each size
        said: set[str] = set()
        for index, (label, picture) in enumerate(zip(self._labels, self._pictures(), strict=True)):
            if isinstance(picture, SourceError):
                if self.length == 1:
                    raise picture
                self._skip(f"frame {index}", picture)
                continue
            for remark in _remarks(picture):
                if remark not in said:
                    said.add(remark)
                    logger.warning("%s: %s", label, remark)
            stamp = None if self.fps is None else index / self.fps
            frame = Frame(
                picture.image,
                picture.mask,
                camera=self._camera,
                index=index,
                stamp=stamp,
                name=label,
                mask_is=self._mask_is,
                instances=picture.instances,
            )
            if frame.size not in names:
                names[frame.size] = frame.name
                if len(names) == 2:
                    self._warn_of_size(names)
            yield frame
            if self._closed:
                return

    def _warn_of_size(self, names: dict[tuple[int, int], str]) -> None:
        (before, now), (first, other) = names, names.values()
        logger.warning(
            "%s: the frames differ in size: %s has %d x %d pixels, %s before it %d x %d; tracks begin anew with each "
            "change of size",
            self.name,
            other,
            *now[::-1],
            first,
            *before[::-1],
        )


def _remarks(picture: Picture) -> Iterator[str]:
    yield from picture.remarks
    if picture.turned != AS_STORED:
        yield (
            f"viewers and cv2.imread show it {MEANINGS[picture.turned]} (EXIF orientation {picture.turned}); it is "
            "read as it is stored, since a camera, depth or masks go with it. These must be for pictures as stored "
            "(cv2.IMREAD_IGNORE_ORIENTATION); where they are for turned ones, save the pictures turned, without the "
            "orientation (mogrify -auto-orient)"
        )
