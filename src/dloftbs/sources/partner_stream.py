"""A video or an animation beside other frames, decoded in step with them."""

from __future__ import annotations

from collections.abc import Iterator

from dloftbs.data.frame import Frame
from dloftbs.data.instance_labels import Size
from dloftbs.sources.source import Source, logger
from dloftbs.support.arrays import AnyArray


class StreamPartner:
    """Masks or depth of a video or an animation, that of each frame by its index.

    Parameters
    ----------
    what : {"depth", "mask", "occluders"}
    source : Source
        Of masks; belongs to this one from now on.
    """

    def __init__(self, what: str, source: Source) -> None:
        self.count: int | None = source.exact_length
        self._what = what
        self._source = source
        self._frames: Iterator[Frame] | None = None
        self._frame: Frame | None = None  # the latest
        self._given = 0

    def start(self) -> StreamPartner:
        """Return it for one iteration, with indices that grow."""
        return StreamPartner(self._what, self._source)

    def read(self, index: int, size: Size) -> AnyArray | None:
        """Return what goes with a frame (H, W); None behind the end, or where it is missing, which is reported."""
        while self._frame is None or self._frame.index < index:
            if not self._advance():
                return None
        if self._frame.index == index:
            return self._frame.mask
        logger.warning("frame %d goes without %s: %s lacks it", index, self._what, self._source.name)
        return None

    def counted(self) -> int:
        """Return the number of frames, after reading to the end."""
        while self.count is None:
            self._advance()
        return self.count

    def close(self) -> None:
        """Close the source."""
        self._source.close()

    def _advance(self) -> bool:
        """Read a frame, and return whether there was one."""
        self._frames = self._frames or iter(self._source)
        frame = next(self._frames, None)
        if frame is None:
            self.count = self._given + self._source.skipped
            return False
        self._frame, self._given = frame, self._given + 1
        return True
