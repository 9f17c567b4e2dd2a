"""Streams of a video container: which of them is the video."""

from __future__ import annotations

from typing import Any

from dloftbs.errors import SourceError


def main_stream(container: Any) -> tuple[Any, str | None]:
    """Return the stream to read, and the names of others that are left out.

    Cover pictures, tiles and stills beside a video are none of them.

    Raises
    ------
    SourceError
        If there is none, or it cannot be decoded.
    """
    from av.stream import Disposition

    aside = Disposition.attached_pic | Disposition.timed_thumbnails | Disposition.dependent
    streams = [stream for stream in container.streams.video if not stream.disposition & aside]
    if not streams:
        kinds = sorted({stream.type for stream in container.streams})
        raise SourceError(f"has no moving pictures; it holds {' and '.join(kinds) or 'nothing'}")
    best = container.streams.best("video")
    chosen = best if best in streams else streams[0]
    if chosen.codec_context is None:
        raise SourceError("its codec is none that FFmpeg decodes")
    others = [f"{s.index} ({_size(s)})" for s in streams if s is not chosen and s.frames != 1]
    is_avif = "avis" in container.metadata.get("compatible_brands", "")  # whose other stream is the alpha channel
    if is_avif or not others:
        return chosen, None
    remedy = "to read another, copy it to a file of its own"
    return chosen, f"of its streams {chosen.index} ({_size(chosen)}) is read, and not {', '.join(others)}; {remedy}"


def _size(stream: Any) -> str:
    context = stream.codec_context
    return "unknown" if context is None else f"{context.width} x {context.height}"
