"""Baselines: methods of other families, written from published equations, to be measured beside the package's own.

They are no part of the package's methods, and none of the authors' code. `CoherentPointDrift` follows one cable, of
which it is given the length and the start; ``dloftbs evaluate --method cpd`` scores it.
"""

from __future__ import annotations

from dloftbs_lab.evaluation.baselines.coherent_point_drift import LENGTHS, CoherentPointDrift

__all__ = ["LENGTHS", "CoherentPointDrift"]
