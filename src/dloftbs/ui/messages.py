"""Messages of the browser, each a type that is checked while it is decoded: a wrong one is an error in words."""

from __future__ import annotations

from typing import Annotated, Literal

import msgspec
from msgspec import Meta

from dloftbs.errors import InputError

LARGEST_PX = 1e5
"""Largest coordinate of a pointer, px of the image; a stroke may leave the image."""
MAX_POINTS = 4000
"""Number of points of one stroke, more than a minute of drawing."""
MAX_RANGES = 16
MAX_CABLES = 1000
"""Largest number of cables that the page takes, far more than a frame shows."""
MAX_BYTES = 1 << 20
"""Size of a message, bytes."""

Coordinate = Annotated[float, Meta(ge=-LARGEST_PX, le=LARGEST_PX)]
Radius = Annotated[float, Meta(ge=0.5, le=1000.0)]
Points = Annotated[tuple[tuple[Coordinate, Coordinate], ...], Meta(min_length=1, max_length=MAX_POINTS)]
Index = Annotated[int, Meta(ge=0, le=10**9)]
Hue = Annotated[int, Meta(ge=0, le=179)]
Level = Annotated[int, Meta(ge=0, le=255)]
Ranges = Annotated[tuple[tuple[Hue, Hue, Level, Level, Level, Level], ...], Meta(max_length=MAX_RANGES)]
Cables = Annotated[int, Meta(ge=1, le=MAX_CABLES)]
Box = tuple[Coordinate, Coordinate, Coordinate, Coordinate]
Height = Annotated[float, Meta(gt=0.0, le=1.0)]


class Message(msgspec.Struct, frozen=True, forbid_unknown_fields=True, tag_field="type"):
    """Base of all messages; the field ``type`` names which."""


class Ack(Message, frozen=True, tag="ack"):
    """The browser has painted a picture."""

    number: Index


class Seek(Message, frozen=True, tag="seek"):
    """Show a frame, and no draft any more; None is the newest one of a camera."""

    index: Index | None


class Draw(Message, frozen=True, tag="draw"):
    """Draw a stroke, ``done`` when the pointer is lifted; before that it is a draft."""

    frame: Index
    points: Points
    cable: bool
    radius_px: Radius
    done: bool


class AcceptStrokes(Message, frozen=True, tag="accept_strokes"):
    """Take every colour beneath strokes on cables for the cable's, or only what the rest of the picture lacks."""

    accept: bool


class Erase(Message, frozen=True, tag="erase"):
    """Take away the parts of strokes that a path touches."""

    frame: Index
    points: Points
    radius_px: Radius


class SetRanges(Message, frozen=True, tag="ranges"):
    """Set the ranges of hue, saturation and value; while a slider moves they are a draft."""

    ranges: Ranges
    done: bool


class SetHeight(Message, frozen=True, tag="height"):
    """Set the height above the ground from which on a pixel is cable, m; None asks no depth."""

    height_m: Height | None
    join: Literal["and", "or"]
    done: bool


class SetMethod(Message, frozen=True, tag="method"):
    """Choose what tells cables from the ground."""

    method: str


class SetObjects(Message, frozen=True, tag="objects"):
    """Set the number of cables; None leaves it open."""

    objects: Cables | None


class SetRegion(Message, frozen=True, tag="region"):
    """Set the region of interest, by a rectangle ``x, y, w, h`` or the corners of a polygon; else it is all."""

    box: Box | None = None
    corners: Points | None = None


class Undo(Message, frozen=True, tag="undo"):
    """Take back the last change."""


class Redo(Message, frozen=True, tag="redo"):
    """Make the change again that was taken back last."""


class Clear(Message, frozen=True, tag="clear"):
    """Remove all strokes and ranges."""


class Accept(Message, frozen=True, tag="accept"):
    """Take the suggestion over as strokes."""

    frame: Index


class Delete(Message, frozen=True, tag="delete"):
    """Say that the object at a point of a frame is no cable."""

    frame: Index
    point: tuple[Coordinate, Coordinate]


class Save(Message, frozen=True, tag="save"):
    """Write the configuration to the file that the command line named."""


class Pause(Message, frozen=True, tag="pause"):
    """Hold on, or go on."""

    paused: bool


class Step(Message, frozen=True, tag="step"):
    """Go on by one frame."""


class Loop(Message, frozen=True, tag="loop"):
    """Begin again at the end, or do not."""

    loop: bool


class Restart(Message, frozen=True, tag="restart"):
    """Begin at the first frame."""


EditMessage = Draw | AcceptStrokes | Erase | SetRanges | SetHeight | SetMethod | SetObjects | SetRegion | Clear
TuneMessage = EditMessage | Ack | Seek | Undo | Redo | Accept | Delete | Save
ViewMessage = Ack | Pause | Step | Loop | Restart | SetObjects
_DECODER: msgspec.json.Decoder[TuneMessage | ViewMessage] = msgspec.json.Decoder(TuneMessage | ViewMessage)


def read(data: str | bytes) -> TuneMessage | ViewMessage:
    """Decode a message.

    Raises
    ------
    InputError
        If it is no JSON, or none of the messages.
    """
    try:
        return _DECODER.decode(data)
    except (msgspec.DecodeError, UnicodeError) as error:
        raise InputError(f"a message that the page may not send: {error}") from error
