"""Graphs of branches to centre lines of whole objects: which ends belong together."""

from __future__ import annotations

from dataclasses import dataclass

from dloftbs.config import LinkingConfig
from dloftbs.data.centerline import Centerline
from dloftbs.data.graph import Graph
from dloftbs.data.mask_crop import MaskCrop
from dloftbs.evidence import EvidenceMap
from dloftbs.linking.branch_points import find_branch_points, shared_by_none
from dloftbs.linking.centerlines import assemble
from dloftbs.linking.end_matching import match_ends
from dloftbs.linking.evidence_steps import EvidenceSteps, exchange_by_evidence
from dloftbs.linking.expected_cables import with_expected
from dloftbs.linking.hidden_ends import lead_straightest_through, link_hidden_ends
from dloftbs.linking.joint_confidence import open_doubtful_gaps
from dloftbs.linking.known_count import merge_to_count
from dloftbs.linking.loops import close_rings, open_loops
from dloftbs.linking.matched_ends import EndMatching
from dloftbs.linking.object_selection import choose
from dloftbs.linking.parallel_runs import separate_parallel_runs
from dloftbs.linking.soft_existence import with_soft_existence
from dloftbs.linking.soft_lines import with_ends_that_go_on, with_soft_widths
from dloftbs.linking.temporal_prior import TemporalPrior

__all__ = [
    "Linking",
    "TemporalPrior",
    "choose",
    "link",
    "with_ends_that_go_on",
    "with_expected",
    "with_soft_existence",
    "with_soft_widths",
]


@dataclass(frozen=True, eq=False)
class Linking:
    """The centre lines of a frame, and the matching of ends that they come from.

    Parameters
    ----------
    centerlines : list of Centerline
    matching : EndMatching
    """

    centerlines: list[Centerline]
    matching: EndMatching


def link(
    crop: MaskCrop,
    graph: Graph,
    config: LinkingConfig,
    evidence: EvidenceMap | None = None,
    prior: TemporalPrior | None = None,
) -> Linking:
    """Join the branches of a graph to whole objects: the steps of linking, in their order.

    Parameters
    ----------
    crop : MaskCrop
    graph : Graph
        Of its skeleton.
    config : LinkingConfig
    evidence : EvidenceMap, optional
        What the frame has besides its mask; without it a gap is judged by the mask alone.
    prior : TemporalPrior, optional
        Predicted curves, which ambiguous links follow.

    Returns
    -------
    Linking
    """
    at_ends = None if evidence is None else evidence.at(graph)
    matching = match_ends(crop, graph, config.max_gap_widths, prior, at_ends, branched=config.branched)
    if config.branched and (own := shared_by_none(graph, matching)):
        matching = match_ends(crop, graph, config.max_gap_widths, prior, at_ends, branched=True, unshared=own)
    lead_straightest_through(graph, matching, config.max_gap_widths)
    steps = None
    if at_ends is not None and at_ends.tells_steps and bool((graph.nodes >= 0).any()):
        steps = EvidenceSteps(graph, matching, at_ends)
        exchange_by_evidence(graph, matching, steps)
    separate_parallel_runs(graph, matching, prior, steps)
    open_loops(graph, matching)
    close_rings(graph, matching)
    link_hidden_ends(graph, matching, config.max_gap_widths, steps)
    open_doubtful_gaps(matching, graph.width, config.min_gap_confidence)
    if config.objects is not None:
        merge_to_count(graph, matching, config.objects, at_ends)
    places = {}
    if config.branched:
        places = find_branch_points(crop.oriented(crop.pixels), graph, matching, config.min_length_widths * graph.width)
    return Linking(assemble(crop, graph, matching, config.min_length_widths, places), matching)
