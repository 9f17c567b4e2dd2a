"""Results in, pictures out: the curves over a frame, the stages of one frame, many pictures on one sheet."""

from dloftbs.viz.overlay import draw
from dloftbs.viz.sheet import contact_sheet
from dloftbs.viz.stages import draw_stages
from dloftbs.viz.style import Style

__all__ = ["Style", "contact_sheet", "draw", "draw_stages"]
