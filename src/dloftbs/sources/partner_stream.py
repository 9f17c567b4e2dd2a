"""Masks from a video or an animation beside other frames, decoded in step with them."""

from __future__ import annotations

from collections.abc import Iterator

from dloftbs._arrays import AnyArray
from dloftbs.errors import SourceError
from dloftbs.frame import Frame
from dloftbs.sources.animations import AnimationSource
from dloftbs.sources.source import Source, logger


class StreamPartner:
    """Masks of a video or an animation, that of each frame by its index.

    Parameters
    ----------
    what : {"depth", "mask", "occluders"}
    source : Source
        Of masks; belongs to this one from now on.

    Raises
    ------
    SourceError
        If it is to be depth.
    """

    def __init__(self, what: str, source: Source) -> None:
        if what == "depth":
            source.close()
            raise SourceError(
                f"{source.name}: depth cannot come from a video or an animation, which have 8 bits; it must be a "
                "folder or a naming rule of images of 16 bits or floating point, a TIFF of several pages, .npy or .npz"
            )
        self.count = source.length if isinstance(source, AnimationSource) else None  # that of a video is a guess
        self.name = source.name
        self._source = source
        self._what = what
        self._frames: Iterator[Frame] = iter(())
        self._ahead: Frame | None = None
        self._wanted = -1

    def read(self, index: int) -> AnyArray | None:
        """Return the mask (H, W) of a frame; None where there is none, which is reported. Going back starts anew."""
        if index <= self._wanted or self._wanted < 0:
            self._frames = iter(self._source)
            self._ahead = next(self._frames, None)
        self._wanted = index
        while self._ahead is not None and self._ahead.index < index:
            self._ahead = next(self._frames, None)
        if self._ahead is not None and self._ahead.index == index:
            return self._ahead.mask
        why = "it ended before" if self._ahead is None else "its frame was skipped"
        logger.warning("frame %d goes without %s of %s: %s", index, self._what, self.name, why)
        return None

    def goes_on(self) -> bool:
        """Return whether there are more after the last one that was read."""
        return self._ahead is not None and next(self._frames, None) is not None

    def close(self) -> None:
        """Close the video."""
        self._ahead = None
        self._source.close()
