"""Results in, pictures out: the curves over a frame and in space, the stages of one frame, many on one sheet."""

from dloftbs.viz.overlay import as_png, draw
from dloftbs.viz.sheet import contact_sheet
from dloftbs.viz.space_sheet import draw_3d
from dloftbs.viz.stage_pictures import draw_stages
from dloftbs.viz.style import Style
from dloftbs.viz.vector_picture import show

__all__ = ["Style", "as_png", "contact_sheet", "draw", "draw_3d", "draw_stages", "show"]


def __dir__() -> list[str]:
    return sorted(__all__)
