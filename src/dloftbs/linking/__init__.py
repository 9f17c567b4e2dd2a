"""Graphs of branches to centre lines of whole objects: which ends belong together."""

from __future__ import annotations

from dataclasses import dataclass

from dloftbs.centerline import Centerline
from dloftbs.config import LinkingConfig
from dloftbs.evidence import EvidenceMap
from dloftbs.graph import Graph, Pairing
from dloftbs.linking.centerlines import assemble
from dloftbs.linking.end_matching import pair
from dloftbs.linking.hidden_ends import join_inside
from dloftbs.linking.loops import join_unclear, open_rings
from dloftbs.linking.object_selection import choose
from dloftbs.linking.parallel_runs import settle_lanes
from dloftbs.mask_crop import MaskCrop
from dloftbs.prior import TemporalPrior

__all__ = ["Linking", "choose", "link"]


@dataclass(frozen=True, eq=False)
class Linking:
    """The centre lines of a frame, and the pairing of ends that they come from.

    Parameters
    ----------
    centerlines : list of Centerline
    pairing : Pairing
    """

    centerlines: list[Centerline]
    pairing: Pairing


def link(
    patch: MaskCrop,
    graph: Graph,
    config: LinkingConfig,
    evidence: EvidenceMap | None = None,
    prior: TemporalPrior | None = None,
) -> Linking:
    """Join the branches of a graph to whole objects: the steps of linking, in their order.

    Parameters
    ----------
    patch : MaskCrop
    graph : Graph
        Of its skeleton.
    config : LinkingConfig
    evidence : EvidenceMap, optional
        Of the frame's image; without it a gap is judged by the mask alone.
    prior : TemporalPrior, optional
        Predicted curves, which ambiguous links follow.

    Returns
    -------
    Linking
    """
    pairing = pair(patch, graph, config.max_gap_widths, prior, evidence)
    settle_lanes(graph, pairing, prior)
    open_rings(graph, pairing)
    join_inside(graph, pairing, config.max_gap_widths)
    if config.objects is not None:
        join_unclear(graph, pairing, config.objects)
    return Linking(assemble(patch, graph, pairing, config.min_length_widths), pairing)
