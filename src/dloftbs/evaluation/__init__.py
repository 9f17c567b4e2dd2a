"""How good a tracker is: the criteria of the paper, for any tracker's points."""

from __future__ import annotations

from dloftbs.evaluation.metrics import f_distance, l1, l2, l3, l3_undirected, mmd

__all__ = ["f_distance", "l1", "l2", "l3", "l3_undirected", "mmd"]
