"""Evidence in a frame of what lies between the ends of cables, which linking asks."""

from __future__ import annotations

from dloftbs.evidence.evidence_map import EvidenceMap

__all__ = ["EvidenceMap"]
