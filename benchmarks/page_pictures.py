"""The pictures of the pages on the stages and on troubleshooting: what the default makes of masks drawn here.

Run it in the repository with ``python -m benchmarks.page_pictures``. It draws into docs/images/stages and
docs/images/troubleshooting.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

import cv2
import numpy as np
import numpy.typing as npt

from benchmarks.linking_pictures import SCENES, tubes
from dloftbs import Frame, FrameResult, Pipeline, StageTrace, detect
from dloftbs.viz import contact_sheet, draw, shapes
from dloftbs.viz.shapes import Picture
from dloftbs.viz.style import PALETTE, Style

IMAGES = Path("docs/images")

_ZOOM = 3
_STYLE = Style(line_px=3.5, text_px=20.0, marker_px=9.0)
_NOISE_SEED = 5
_SCENE = {scene.name: scene.draw for scene in SCENES}

Mask = npt.NDArray[np.bool_]
_ONE = [(15, 110), (70, 70), (140, 100), (245, 60)]
_OTHER = [(15, 40), (90, 70), (170, 50), (245, 130)]


def main() -> None:
    """Draw all pictures."""
    for name, draw_one in PICTURES.items():
        path = IMAGES / f"{name}.png"
        path.parent.mkdir(parents=True, exist_ok=True)
        cv2.imwrite(str(path), draw_one(), [cv2.IMWRITE_PNG_COMPRESSION, 9])


def sheet(panels: Sequence[tuple[str, Picture]]) -> Picture:
    """Return panels side by side, with titles."""
    return contact_sheet(
        [picture for _, picture in panels], [title for title, _ in panels], columns=len(panels), tile_width=390
    )


def large(mask: Mask) -> Mask:
    """Return an enlarged mask."""
    return np.kron(mask, np.ones((_ZOOM, _ZOOM), np.bool_))


def pair(before: str, after: str, wrong: Mask, right: Mask) -> Picture:
    """Return what is found in a mask that is wrong, and in one that is right."""
    panels = []
    for title, mask in ((before, large(wrong)), (after, large(right))):
        found = detect(mask)
        panels.append((f"{title}: {count(found)}", draw(mask, found, style=_STYLE)))
    return sheet(panels)


def count(found: FrameResult) -> str:
    """Return a number of curves in words."""
    return f"{len(found)} curve{'' if len(found) == 1 else 's'}"


def trace(mask: Mask) -> StageTrace:
    """Return all stages of a mask at its own size."""
    return Pipeline().trace(Frame(mask=mask))


def noisy() -> Mask:
    """Return two cables with salt, pepper and a highlight along one of them."""
    rng = np.random.default_rng(_NOISE_SEED)
    mask = tubes(_ONE, _OTHER)
    mask ^= rng.random(mask.shape) < 0.01
    highlight = tubes(_ONE, width_px=3.0)
    highlight[:, :180] = highlight[:, 230:] = False
    return mask & ~highlight


def cleaning() -> Picture:
    """Return a mask before and after the cleaning."""
    mask = noisy()
    return sheet([("mask", draw(large(mask), ())), ("cleaned", draw(large(trace(mask).cleaned), ()))])


def skeleton() -> Picture:
    """Return a mask with its skeleton, endpoints and branch points."""
    seen = trace(_SCENE["spur"]() | tubes([(60, 130), (85, 100), (110, 70), (150, 30)]))
    picture = draw(large(seen.cleaned), ())
    for point in seen.skeleton:
        x, y = (_ZOOM * point).astype(int)
        picture[y : y + _ZOOM, x : x + _ZOOM] = PALETTE[4]
    marks = [shapes.ring(_ZOOM * point + 1.0, 7.0, PALETTE[7], 2.0) for point in seen.branch_points]
    marks += [shapes.disc(_ZOOM * point + 1.0, 5.0, PALETTE[1]) for point in seen.endpoints]
    shapes.paint(picture, marks, _STYLE)
    return picture


def fitting() -> Picture:
    """Return a curve with its control points."""
    mask = large(_SCENE["loop"]())
    return draw(mask, detect(mask), style=_STYLE, control_points=True)


def crossings() -> Picture:
    """Return a picture of two cables that cross, and what was found in it."""
    below, above = large(tubes(_ONE)), large(tubes(_OTHER))
    image: Picture = np.full((*below.shape, 3), (96, 110, 104), np.uint8)
    image[below], image[above] = (60, 60, 190), (170, 110, 50)
    image = cv2.GaussianBlur(image, (5, 5), 1.0)
    found = detect(below | above, image=image)
    return sheet([("image", image), ("found", draw(image, found, style=_STYLE))])


def inverted() -> Picture:
    """Return a mask with ground and cable swapped, beside the right one."""
    mask = tubes(_ONE, _OTHER)
    return pair("inverted", "right", ~mask, mask)


def pieces() -> Picture:
    """Return a mask that lacks more than half of a cable, and one with a short gap."""
    mask = tubes(_ONE)
    wide, short = mask.copy(), mask.copy()
    wide[:, 60:205] = False
    short[:, 120:140] = False
    return pair("half is missing", "a short gap", wide, short)


def debris() -> Picture:
    """Return a mask with ground in it, beside the right one."""
    mask = tubes(_ONE)
    ground = (
        mask
        | tubes([(40, 20), (60, 16), (85, 18), (110, 25)], width_px=9.0)
        | tubes([(160, 135), (190, 139), (215, 139), (235, 136)], width_px=10.0)
    )
    return pair("ground comes in", "cable alone", ground, mask)


def side_by_side() -> Picture:
    """Return two cables that touch over their whole length, and two with a gap between them."""
    lower = [(x, y + 11) for x, y in _ONE]
    apart = [(x, y - 30) for x, y in _ONE]
    return pair("touching", "a gap between", tubes(_ONE, lower), tubes(_ONE, apart))


def shadow() -> Picture:
    """Return a cable whose shadow is in the mask, beside the right one."""
    mask = tubes(_ONE)
    cast = tubes([(15, 110), (70, 78), (140, 118), (245, 72)], width_px=9.0)
    return pair("with its shadow", "cable alone", mask | cast, mask)


def thin() -> Picture:
    """Return a cable of which a threshold leaves dashes, and one that is whole."""
    whole, dashes = tubes(_ONE, width_px=3.0), tubes(_ONE, width_px=3.0)
    for start in range(20, 240, 26):
        dashes[:, start : start + 20] = False
    return pair("too strict", "whole", dashes, whole)


def instances() -> Picture:
    """Return the masks of two cables that cross, the lower one cut as a segmenter leaves it, and the curves."""
    upper, lower = large(tubes(_OTHER)), large(tubes(_ONE)) & ~large(tubes(_OTHER))
    parts = cv2.connectedComponents(lower.astype(np.uint8))[1]
    masks = [upper, *(parts == part for part in range(1, parts.max() + 1))]
    painted = draw(upper | lower, ())
    for mask, colour in zip(masks, PALETTE, strict=False):
        painted[mask] = colour
    found = detect(instances=masks)
    return sheet([(f"{len(masks)} masks", painted), (count(found), draw(upper | lower, found, style=_STYLE))])


PICTURES: dict[str, Callable[[], Picture]] = {
    "stages/cleaning": cleaning,
    "stages/skeleton": skeleton,
    "stages/fitting": fitting,
    "stages/crossings": crossings,
    "stages/instances": instances,
    "troubleshooting/inverted": inverted,
    "troubleshooting/pieces": pieces,
    "troubleshooting/debris": debris,
    "troubleshooting/side-by-side": side_by_side,
    "troubleshooting/shadow": shadow,
    "troubleshooting/too-strict": thin,
}


if __name__ == "__main__":
    main()
