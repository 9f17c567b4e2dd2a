"""Results of the default method on a mask, stage by stage, and the costs of the readings that it chose between."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from dloftbs import Config, Detection, Frame
from dloftbs.config import LinkingConfig
from dloftbs.data.centerline import Joint
from dloftbs.data.graph import POSITION, TANGENT, Graph, branch_of, ends_of, other_end
from dloftbs.data.mask_crop import MaskCrop
from dloftbs.linking import link
from dloftbs.linking.end_matching import Ends, list_joints, match_ends
from dloftbs.linking.kernels import branch_overlap, wide_stretches
from dloftbs.linking.kernels.joint_features import prices
from dloftbs.linking.kernels.pair_costs import junction_costs
from dloftbs.linking.kernels.weights import JOINT, OPEN
from dloftbs.linking.matched_ends import Branches, EndMatching
from dloftbs.pipeline.stages import run_stages

Points = npt.NDArray[np.float64]
Mask = npt.NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class Look:
    """A mask and the default method's results on it; points are the image's, px."""

    mask: Mask
    crop: MaskCrop
    graph: Graph
    matched: EndMatching
    linked: EndMatching
    detections: tuple[Detection, ...]

    @property
    def joints(self) -> list[tuple[Detection, Joint]]:
        """All joints, cable after cable."""
        return [(detection, joint) for detection in self.detections for joint in detection.joints]

    @property
    def nodes(self) -> list[int]:
        """The junction at each end of the graph."""
        return self.graph.nodes.tolist()

    @property
    def end_rays(self) -> list[tuple[Points, Points]]:
        """Position of each end of the graph, clear of its junction, and its direction outwards."""
        places = self.crop.to_image(self.graph.end_states[:, POSITION])
        tips = self.crop.to_image(self.graph.end_states[:, POSITION] + self.graph.end_states[:, TANGENT])
        return [(place, tip - place) for place, tip in zip(places, tips, strict=True)]

    @property
    def junctions(self) -> list[Points]:
        """Mean position of the ends at each junction."""
        places = self.crop.to_image(self.graph.end_states[:, POSITION])
        nodes = self.graph.nodes
        return [places[nodes == node].mean(axis=0) for node in np.unique(nodes[nodes >= 0])]

    @property
    def spurs(self) -> list[Points]:
        """Points of each branch that is a spur."""
        points, offsets = self.crop.to_image(self.graph.points), self.graph.offsets
        return [points[offsets[branch] : offsets[branch + 1]] for branch in np.flatnonzero(self.graph.spurs)]


def look_at(mask: Mask) -> Look:
    """Run the stages on a mask and keep their results."""
    config = Config()
    assert isinstance(config.linking, LinkingConfig)
    run = run_stages(Frame(mask=mask), config, None)
    assert run.crop is not None  # the scenes have cables
    assert run.graph is not None
    matched = match_ends(run.crop, run.graph, config.linking.max_gap_widths)
    linked = link(run.crop, run.graph, config.linking).matching
    return Look(mask, run.crop, run.graph, matched, linked, run.detections)


@dataclass(frozen=True)
class Reading:
    """One way to join the ends: pairs of names, and the total cost."""

    pairs: tuple[tuple[str, str], ...]
    open_ends: tuple[str, ...]
    cost: float
    shared: bool

    def __str__(self) -> str:
        joined = ", ".join(f"{a}-{b}" for a, b in self.pairs)
        parts = [joined or "nothing", f"{', '.join(self.open_ends)} open" if self.open_ends else ""]
        return "; ".join(part for part in parts if part)


def names_of(look: Look) -> dict[int, str]:
    """Return letters for the ends of the graph that can be joined at less than leaving them open costs."""
    rows, columns, _, _ = _pair_costs(look, look.matched.branches)
    ends = sorted(
        {int(end) for end in np.concatenate((rows, columns))}, key=lambda end: _end_ids(look.matched.branches)[end]
    )
    ends = sorted({int(_end_ids(look.matched.branches)[end]) for end in ends})
    ends.sort(key=lambda end: (look.end_rays[end][0][0], look.end_rays[end][0][1]))
    return dict(zip(ends, "abcdefghijklmnop", strict=False))


def list_readings(look: Look, most: int) -> list[Reading]:
    """Return the cheapest ways to join the ends; branches that two cables share count twice, where that was found."""
    found = _enumerate(look, look.matched.branches, _overlap_cost(look))
    if look.matched.branches.duplicate_of:
        found += _enumerate(look, branches_without_duplicates(look), 0.0)
    found.sort(key=lambda reading: reading.cost)
    kept: dict[tuple[object, ...], Reading] = {}
    for reading in found:
        kept.setdefault((reading.pairs, reading.open_ends, reading.shared), reading)
    return list(kept.values())[:most]


def branches_without_duplicates(look: Look) -> Branches:
    """Return the branches of the graph, each once."""
    n, full = look.graph.branch_count, look.matched.branches
    return full._replace(
        branch_id=full.branch_id[:n],
        nodes=look.nodes,
        open_cost=full.open_cost[: 2 * n],
        spans=full.spans[:n],
        spurs=full.spurs[:n],
        end_states=look.graph.end_states,
        duplicate_of={},
    )


def readings(look: Look) -> str:
    """Return a table in Markdown of the cheapest readings."""
    head = ["| reading | cost |", "| --- | ---: |"]
    shares = bool(look.matched.branches.duplicate_of)
    rows = []
    for k, reading in enumerate(list_readings(look, 3)):
        how = (" (shared branches counted twice)" if reading.shared else " (each branch once)") if shares else ""
        rows.append(f"| {'**' if k == 0 else ''}{reading}{'**' if k == 0 else ''}{how} | {reading.cost:.2f} |")
    ways = [f"{a} goes on in {b}" for a, b in exits_of(look)]
    return "\n".join(head + rows + (["", f"Along the shared branches: {', '.join(ways)}."] if ways else []))


def exits_of(look: Look) -> list[tuple[str, str]]:
    """Return the pairs of ends before and behind shared branches that the offset axes connect."""
    names, linked, ids = names_of(look), look.linked, _end_ids(look.linked.branches)
    found, shared = [], linked.branches.duplicate_of
    for start, end in enumerate(linked.partner):
        passed = False
        at = end
        while at >= 0 and branch_of(at) in shared:
            at, passed = linked.partner[other_end(at)], True
        if passed and at > start and branch_of(start) not in shared:
            one, other = sorted((names[int(ids[start])], names[int(ids[at])]))
            found.append((one, other))
    return sorted(found)


def joints_block(look: Look) -> str:
    """Return `Detection.joints` and `Detection.near_joints` as text."""
    lines = ["```"]
    for cable, detection in enumerate(look.detections):
        for joint in detection.joints:
            to = ", ".join("open" if p is None else f"({p[0]:.0f}, {p[1]:.0f})" for p in joint.alternatives)
            span = f"u {joint.u[0]:.2f} to {joint.u[1]:.2f}"
            figures = f"cost {joint.cost:.2f}, margin {joint.margin:.2f}, confidence {joint.confidence:.2f}"
            lines.append(f"cable {cable}: {joint.kind.value:8} {span}, {figures}, otherwise {to}")
        for near in detection.near_joints:
            to = f"({near.point[0]:.0f}, {near.point[1]:.0f})"
            lines.append(
                f"cable {cable}: open     u {near.u:.0f}, near joint with confidence {near.confidence:.2f} to {to}"
            )
    return "\n".join([*lines, "```"])


def _end_ids(branches: Branches) -> npt.NDArray[np.int64]:
    return ends_of(np.array(branches.branch_id, np.int64))


def _pair_costs(look: Look, branches: Branches) -> tuple[npt.NDArray[np.int64], npt.NDArray[np.int64], Points, Points]:
    graph, ids = look.graph, _end_ids(branches)
    config = Config().linking
    assert isinstance(config, LinkingConfig)
    ends = Ends(
        np.array(branches.nodes),
        ids,
        np.ascontiguousarray(branches.end_states),
        graph.end_roundness[ids],
        np.array(branches.spurs),
        graph.bordering[ids],
        graph.corners[ids],
    )
    rows, columns, joints, opens = list_joints(graph, ends, config.max_gap_widths, None, 0.0)
    return rows, columns, prices(joints, JOINT), prices(opens, OPEN)


def _enumerate(look: Look, branches: Branches, extra: float) -> list[Reading]:
    """List all matchings of the ends that have pairs, with their costs."""
    rows, columns, costs, open_cost = _pair_costs(look, branches)
    names, ids = names_of(look), _end_ids(branches)
    ends = sorted({int(end) for end in np.concatenate((rows, columns))})
    cost = {(int(i), int(j)): float(c) for i, j, c in zip(rows, columns, costs, strict=True)}
    found: list[Reading] = []

    def go_on(left: list[int], pairs: list[tuple[int, int]], lonely: list[int], total: float) -> None:
        if not left:
            named = sorted(tuple(sorted((names[int(ids[i])], names[int(ids[j])]))) for i, j in pairs)
            alone = sorted(names[int(ids[i])] for i in lonely if open_cost[i] > 0.0)
            found.append(
                Reading(tuple((a, b) for a, b in named), tuple(alone), total + extra, bool(branches.duplicate_of))
            )
            return
        i, rest = left[0], left[1:]
        go_on(rest, pairs, [*lonely, i], total + float(open_cost[i]))
        for j in rest:
            if (i, j) in cost:
                go_on([k for k in rest if k != j], [*pairs, (i, j)], lonely, total + cost[i, j])

    go_on(ends, [], [], 0.0)
    return found


def _overlap_cost(look: Look) -> float:
    """Return the cost of sharing the branches by itself, where it was found."""
    ids = look.matched.branches.branch_id
    shared = {branch for branch in ids if ids.count(branch) > 1}
    if not shared:
        return 0.0
    graph = look.graph
    spans = graph.spans
    reach, widths = wide_stretches.wide_reach(spans, graph.radius, graph.width)
    links = junction_costs(graph.nodes, graph.spurs, graph.corners, graph.end_states, graph.width)
    anywhere = np.ones(len(links[0]) - 1, dtype=np.bool_)
    paths, _, costs = branch_overlap.list_paths(
        graph.nodes, graph.spurs, anywhere, reach, spans, widths, graph.width, *links
    )
    return min(
        float(cost)
        for path, cost in zip(paths, costs, strict=True)
        if set(branch_of(path[path >= 0]).tolist()) == shared
    )
