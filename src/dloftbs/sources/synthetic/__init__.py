"""Generated sequences: cables on a workbench, rendered with the truth beside them."""

from __future__ import annotations

from dloftbs.sources.synthetic.demo import DemoSequence
from dloftbs.sources.synthetic.strand import random_curve
from dloftbs.sources.synthetic.tube import draw_tube_mask

__all__ = ["DemoSequence", "draw_tube_mask", "random_curve"]
