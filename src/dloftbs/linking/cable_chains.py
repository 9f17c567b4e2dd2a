"""Stage 5, before the result: the chains of branches that are cables."""

from __future__ import annotations

from dloftbs.graph import FREE, Branches, EndMatching, branch_of, other_end


def list_cables(matching: EndMatching) -> list[tuple[list[int], bool]]:
    """List the chains that are cables, and whether each is a loop, without what is left of shared branches.

    Parameters
    ----------
    matching : EndMatching

    Returns
    -------
    list of (list of int, bool)
        In the order of `EndMatching.chains`.
    """
    cables: list[tuple[list[int], bool]] = []
    left_over: set[int] = set()
    for chain, is_loop in matching.chains():
        if _is_left_over(matching.branches, chain, left_over):
            left_over |= {branch_of(end) for end in chain}
        else:
            cables.append((chain, is_loop))
    return cables


def _is_left_over(branches: Branches, chain: list[int], left_over: set[int]) -> bool:
    """Tell whether a chain consists of duplicates of shared branches alone, and has no free end."""
    duplicate_of, nodes = branches.duplicate_of, branches.nodes
    if not duplicate_of or any(duplicate_of.get(branch_of(end), -1) in left_over | {-1} for end in chain):
        return False
    return all(nodes[end] != FREE for end in (chain[0], other_end(chain[-1])))
