"""The pictures and tables of docs/linking-rules.md: how the default method reads masks whose truth is known.

Run it in the repository with ``python -m benchmarks.linking_pictures``. It draws a PNG a scene into
docs/images/linking, and replaces what stands between ``<!-- made: NAME -->`` and ``<!-- end -->`` in that page.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
import numpy.typing as npt
from scipy.interpolate import make_interp_spline

from benchmarks.readings import Look, joints_block, look_at, names_of, readings
from dloftbs import BSplineCurve
from dloftbs.data.centerline import JointKind
from dloftbs.data.graph import FREE
from dloftbs.viz import shapes
from dloftbs.viz.lettering import Text
from dloftbs.viz.shapes import Picture, Shape
from dloftbs.viz.style import PALETTE, Colour, Style, dimmed
from dloftbs_lab.synthetic import draw_tube_mask

PAGE = Path("docs/linking-rules.md")
PICTURES = Path("docs/images/linking")

_SIZE = (160, 260)
_ZOOM = 4
_WIDTH_PX = 12.0
_MARGIN_PX = 12
_LETTER_PX = 14.0
_MASK: Colour = (74, 70, 68)
_WHITE: Colour = (255, 255, 255)
_SPUR: Colour = (70, 90, 240)
_STYLE = Style()
_BLOCK = re.compile(r"(<!-- made: ([a-z-]+) -->\n).*?(<!-- end -->)", re.DOTALL)

Points = npt.NDArray[np.float64]
Mask = npt.NDArray[np.bool_]


@dataclass(frozen=True)
class Scene:
    """A mask and its name; the mask is drawn when it is needed."""

    name: str
    draw: Callable[[], Mask]


def main() -> None:
    """Draw all pictures, and bring the page up to date."""
    PICTURES.mkdir(parents=True, exist_ok=True)
    looks = {scene.name: look_at(scene.draw()) for scene in SCENES}
    for name, look in looks.items():
        cv2.imwrite(str(PICTURES / f"{name}.png"), draw(look), [cv2.IMWRITE_PNG_COMPRESSION, 9])
    PAGE.write_text(with_tables(PAGE.read_text("utf-8"), looks), "utf-8")


def with_tables(page: str, looks: Mapping[str, Look]) -> str:
    """Return the text of the page with the tables that belong to the scenes, by name."""
    made = dict[str, str]()
    for name, look in looks.items():
        made |= {name: readings(look), f"{name}-joints": joints_block(look)}
    return _BLOCK.sub(lambda block: f"{block[1]}\n{made[block[2]]}\n\n{block[3]}", page)


def tubes(*ways: Sequence[tuple[float, float]], width_px: float = _WIDTH_PX) -> Mask:
    """Return the mask of cables through points (x, y) px, each a smooth curve."""
    mask = np.zeros(_SIZE, np.bool_)
    for way in ways:
        mask |= draw_tube_mask(_through(way), width_px, _SIZE)
    return mask


def _through(way: Sequence[tuple[float, float]]) -> BSplineCurve:
    points = np.array(way, dtype=np.float64)
    steps = np.linalg.norm(np.diff(points, axis=0), axis=1)
    u = np.concatenate(([0.0], np.cumsum(steps))) / steps.sum()
    spline = make_interp_spline(u, points, k=3)
    return BSplineCurve(spline.t, spline.c)


def _cross() -> Mask:
    return tubes([(25, 30), (90, 55), (165, 92), (235, 135)], [(60, 140), (110, 95), (150, 60), (185, 20)])


def _oblique() -> Mask:
    return tubes([(15, 65), (90, 74), (170, 88), (245, 98)], [(15, 98), (90, 89), (170, 73), (245, 62)])


def _beside_crossing() -> Mask:
    one = [(15, 30), (50, 55), (90, 72), (130, 80), (170, 88), (210, 105), (245, 130)]
    return tubes(one, [(x, 160.0 - y) for x, y in one])


def _beside_touching() -> Mask:
    one = [(15, 30), (50, 55), (90, 71), (130, 75), (170, 71), (210, 55), (245, 30)]
    return tubes(one, [(x, 160.0 - y) for x, y in one])


def _gap() -> Mask:
    mask = tubes(
        [(15, 110), (75, 92), (140, 78), (200, 70), (245, 68)], [(92, 155), (103, 138), (112, 122), (118, 104)]
    )
    rows, columns = np.mgrid[: _SIZE[0], : _SIZE[1]]
    return mask & ~((columns - 122) ** 2 + (rows - 74) ** 2 < 28**2)


def _spur() -> Mask:
    mask = tubes([(15, 90), (80, 78), (150, 80), (245, 60)], width_px=16.0)
    for x, y in ((88, 69), (165, 88)):
        rows, columns = np.mgrid[: _SIZE[0], : _SIZE[1]]
        mask |= (columns - x) ** 2 + (rows - y) ** 2 < 5.0**2
    return mask


def _loop() -> Mask:
    return tubes([(15, 140), (90, 120), (165, 85), (180, 40), (140, 22), (105, 50), (125, 100), (185, 132), (245, 140)])


def _fork() -> Mask:
    return tubes(
        [(15, 79), (45, 80), (80, 81), (110, 80)],
        [(160, 97), (185, 105), (215, 114), (245, 122)],
        [(160, 66), (185, 58), (215, 50), (245, 42)],
    )


SCENES = (
    Scene("cross", _cross),
    Scene("oblique", _oblique),
    Scene("beside-crossing", _beside_crossing),
    Scene("beside-touching", _beside_touching),
    Scene("gap", _gap),
    Scene("spur", _spur),
    Scene("loop", _loop),
    Scene("fork", _fork),
)


def draw(look: Look) -> Picture:
    """Draw a mask with its branches, junctions, ends and joints, enlarged; docs/linking-rules.md has the legend."""
    large = cv2.resize(look.mask.astype(np.uint8), None, fx=_ZOOM, fy=_ZOOM, interpolation=cv2.INTER_NEAREST)
    picture = np.empty((*large.shape, 3), np.uint8)
    picture[:] = _STYLE.ink
    picture[large > 0] = _MASK
    shapes.paint(picture, [*_segments(look), *_joints(look), *_places(look)], _STYLE)
    for end, name in names_of(look).items():
        place, direction = look.end_rays[end]
        across = np.array([-direction[1], direction[0]])
        _write(picture, _shown(place) - 10.0 * direction + 26.0 * (across if across[1] < 0.0 else -across), name)
    for number, (detection, joint) in enumerate(look.joints, start=1):
        _write(picture, _shown(detection.curve(0.75 * joint.u[0] + 0.25 * joint.u[1])), str(number), _STYLE.background)
    rows, columns = (np.flatnonzero(look.mask.any(axis=axis)) for axis in (1, 0))
    top, bottom = max(_ZOOM * (rows[0] - _MARGIN_PX), 0), _ZOOM * (rows[-1] + 1 + _MARGIN_PX)
    left, right = max(_ZOOM * (columns[0] - _MARGIN_PX), 0), _ZOOM * (columns[-1] + 1 + _MARGIN_PX)
    return np.vstack((picture[top:bottom, left:right], _legend(look, min(right, picture.shape[1]) - left)))


def _segments(look: Look) -> list[Shape]:
    """Return all segments, a colour a cable, lighter and darker in turns, and the spurs."""
    drawn = []
    for cable, detection in enumerate(look.detections):
        for k, segment in enumerate(detection.centerline.segments):
            colour = PALETTE[cable] if k % 2 == 0 else dimmed(PALETTE[cable], _WHITE, 0.55)
            drawn.append(shapes.line(_shown(segment.points), colour, 5.0))
    return drawn + [shapes.line(_shown(points), _SPUR, 3.0) for points in look.spurs]


def _joints(look: Look) -> list[Shape]:
    """Return the curve's way along each joint, dashed across gaps."""
    drawn = []
    for detection, joint in look.joints:
        way = _shown(detection.curve(np.linspace(*joint.u, 60)))
        if joint.kind is JointKind.CROSSING:
            drawn.append(shapes.line(way, _WHITE, 2.0))
        else:
            drawn += [shapes.line(way[i : i + 4], _WHITE, 2.0) for i in range(0, 60, 8)]
    return drawn


def _places(look: Look) -> list[Shape]:
    """Return a ring for each junction, and an arrow for each end that can be joined."""
    arrows = [
        shapes.arrow(_shown(place) + 8.0 * direction, direction, 16.0, _STYLE.paper)
        for node, (place, direction) in zip(look.nodes, look.end_rays, strict=True)
        if node >= FREE
    ]
    return [shapes.ring(_shown(place), 9.0, _WHITE, 2.0) for place in look.junctions] + arrows


def _legend(look: Look, width: int) -> Picture:
    """Return a strip that says what each joint costs and how sure it is."""
    lines = [
        f"{number}  {joint.kind.value}: cost {joint.cost:.2f}, margin {joint.margin:.2f}, "
        f"confidence {joint.confidence:.2f}"
        for number, (_, joint) in enumerate(look.joints, start=1)
    ]
    texts = [Text(line, _LETTER_PX) for line in lines or ["no joints"]]
    step = texts[0].size[1]
    strip: Picture = np.full((step * len(texts) + step // 3, width, 3), _STYLE.background, np.uint8)
    for i, text in enumerate(texts):
        text.write(strip, step // 3, i * step, _STYLE.paper)
    return strip


def _write(picture: Picture, place: Points, words: str, plate: Colour | None = None) -> None:
    """Write a word around a place."""
    text = Text(words, _LETTER_PX)
    wide, tall = text.size
    left = int(np.clip(place[0] - wide / 2.0, 0, picture.shape[1] - wide))
    top = int(np.clip(place[1] - tall / 2.0, 0, picture.shape[0] - tall))
    if plate is not None:
        picture[top : top + tall, left : left + wide] = plate
    text.write(picture, left, top, _STYLE.paper)


def _shown(points: Points) -> Points:
    return (points + 0.5) * _ZOOM - 0.5


if __name__ == "__main__":
    main()
