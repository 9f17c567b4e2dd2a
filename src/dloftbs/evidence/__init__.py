"""Evidence in a frame of what lies between the ends of cables, and of what hides them: linking and tracking ask it."""

from __future__ import annotations

from dloftbs.evidence.evidence_map import EndEvidence, EvidenceMap
from dloftbs.evidence.kernels.colour_differences import compare_pairs
from dloftbs.evidence.kernels.occlusion_pixels import HIDDEN, IN_SIGHT, UNKNOWN
from dloftbs.evidence.occlusion import Appearance, OcclusionEvidence

__all__ = [
    "HIDDEN",
    "IN_SIGHT",
    "UNKNOWN",
    "Appearance",
    "EndEvidence",
    "EvidenceMap",
    "OcclusionEvidence",
    "compare_pairs",
]
