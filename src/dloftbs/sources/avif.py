"""AVIF images, decoded by PyAV as videos are: many builds of OpenCV cannot."""

from __future__ import annotations

import io

from dloftbs.errors import SourceError
from dloftbs.sources.video_picture import Converter, VideoPicture
from dloftbs.sources.video_streams import main_stream
from dloftbs.support.arrays import AnyArray


def decode_avif(data: bytes, max_pixels: int) -> AnyArray:
    """Decode an AVIF image, shape (H, W, 3), BGR, without its alpha channel.

    Parameters
    ----------
    data : bytes
        Content of the file.
    max_pixels : int
        Size of an image that is not decoded any more.

    Raises
    ------
    SourceError
        If it cannot be decoded, is too large, or is made of tiles.
    """
    import av

    try:
        with av.open(io.BytesIO(data), metadata_errors="replace") as container:
            stream, _ = main_stream(container)
            stream.codec_context.options = {"max_pixels": str(max_pixels)}
            frame = next(container.decode(stream), None)
            if frame is not None and not frame.is_corrupt:
                return VideoPicture(0, None, frame, Converter()).bgr()
    except av.FFmpegError as error:
        raise SourceError(f"cannot be decoded as an AVIF image: {error.strerror}") from error
    raise SourceError(f"cannot be decoded as an AVIF image: its {len(data)} bytes are corrupt, cut off, or tiles")
