"""What the default method made of a mask, stage by stage, and what the readings cost that it chose between."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from dloftbs import Config, Detection, Frame
from dloftbs.centerline import Joint
from dloftbs.config import LinkingConfig
from dloftbs.graph import Graph, Pairing
from dloftbs.linking import centerlines, link, loops
from dloftbs.linking import end_matching as pairing_stage
from dloftbs.linking.end_matching import pair
from dloftbs.linking.kernels import bending, branch_overlap, end_matching, parallel_runs, wide_stretches
from dloftbs.mask_crop import MaskCrop
from dloftbs.pipeline import run_stages
from dloftbs.skeleton import branch_graph
from dloftbs.skeleton.kernels import branch_ends as arms_kernels

Points = npt.NDArray[np.float64]
Mask = npt.NDArray[np.bool_]

_CONSTANTS: tuple[tuple[str, float], ...] = (
    ("a spur sticks out of its junction by less, widths", branch_graph._SPUR_WIDTHS),
    ("a run with less between two junctions makes them one, widths", branch_graph._MERGE_WIDTHS),
    ("a run is cut where it turns by more within two widths, rad", branch_graph._KINK_RAD),
    ("an arm's direction and curvature are taken over, widths", arms_kernels._REACH_WIDTHS),
    ("... starting outside of the junction by, widths", arms_kernels._CLEAR_WIDTHS),
    ("... and inside of a free end by, widths", arms_kernels._BLUNT_WIDTHS),
    ("... and where the mask tapers there, by up to, widths", arms_kernels._TAPER_WIDTHS),
    ("pass: per rad² of bend, times width / length", bending._PASS_BEND),
    ("pass: per rad² of bend", bending._PASS_TURN),
    ("pass: times the share of the way that leaves the mask", bending._OUTSIDE),
    ("gap: per rad² of bend, times width / length", bending._GAP_BEND),
    ("gap: per rad² of bend", bending._GAP_TURN),
    ("gap: per width of its length", bending.GAP_LENGTH),
    ("gap: less, per width that an image shows to be hidden", pairing_stage._HIDDEN),
    ("gap: from an arm of a junction", bending._GAP_ARM),
    ("open end: arm of a junction", bending.OPEN_ARM),
    ("open end: free and round", bending.OPEN_ROUND),
    ("open end: free and cut off", bending.OPEN_CUT),
    ("open end: of a cable inside of a shared run", bending.OPEN_INSIDE),
    ("open end: at a sharp turn where nothing else meets", bending.OPEN_KINK),
    ("share of the arms' curvature that is believed to go on", bending._PROMISE),
    ("ends that lack less to be joined are in doubt", pairing_stage.UNCLEAR),
    ("gap: per width of ground in sight", pairing_stage._GROUND),
    ("ends matched exactly, up to", end_matching.EXACT),
    ("shared run: per width of its length", branch_overlap._PRICE_PER_WIDTH),
    ("shared run: more per width, where the mask is as narrow as one cable", branch_overlap._PRICE_THIN),
    ("shared run: less per width and width that the mask is wider", branch_overlap._BONUS_WIDE),
    ("shared run: more, if a cable ends inside", branch_overlap._PRICE_END),
    ("shared run: longest, widths", branch_overlap._LONGEST_WIDTHS),
    ("lanes: axes nearer than this may cross, widths", parallel_runs._NARROW),
    ("lanes: smoothness is compared over so many widths before and behind", parallel_runs._WINDOW),
    ("ring: opened into a chain that crosses it where that costs less", loops._WORTH),
    ("confidence of a crossing: margin that multiplies the odds by e", centerlines._CROSSING_SCALE),
    ("confidence of a gap: margin that multiplies the odds by e", centerlines._GAP_SCALE),
)


@dataclass(frozen=True, eq=False)
class Look:
    """A mask, and what the default method made of it; points are the image's, px."""

    mask: Mask
    patch: MaskCrop
    graph: Graph
    paired: Pairing
    settled: Pairing
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
    def arms(self) -> list[tuple[Points, Points]]:
        """Where each end of the graph comes clear of its junction, and its direction outwards."""
        places = self.patch.to_image(self.graph.arms[:, :2])
        tips = self.patch.to_image(self.graph.arms[:, :2] + self.graph.arms[:, 2:4])
        return [(place, tip - place) for place, tip in zip(places, tips, strict=True)]

    @property
    def junctions(self) -> list[Points]:
        """The middle of the arms of each junction."""
        places = self.patch.to_image(self.graph.arms[:, :2])
        nodes = self.graph.nodes
        return [places[nodes == node].mean(axis=0) for node in np.unique(nodes[nodes >= 0])]

    @property
    def spurs(self) -> list[Points]:
        """The points of each run that is a spur."""
        points, offsets = self.patch.to_image(self.graph.points), self.graph.offsets
        return [points[offsets[run] : offsets[run + 1]] for run in np.flatnonzero(self.graph.spurs)]


def look_at(mask: Mask) -> Look:
    """Run the stages on a mask and keep what they made."""
    config = Config()
    assert isinstance(config.linking, LinkingConfig)
    run = run_stages(Frame(mask=mask), config, None)
    assert run.patch is not None  # the scenes have cables
    assert run.graph is not None
    paired = pair(run.patch, run.graph, config.linking.max_gap_widths)
    settled = link(run.patch, run.graph, config.linking).pairing
    return Look(mask, run.patch, run.graph, paired, settled, run.detections)


@dataclass(frozen=True)
class Reading:
    """One way to join the ends: pairs of names, and what it costs in all."""

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
    rows, columns, _, _ = _pair_costs(look, look.paired)
    ends = sorted({int(end) for end in np.concatenate((rows, columns))}, key=lambda end: _identity(look.paired)[end])
    ends = sorted({int(_identity(look.paired)[end]) for end in ends})
    ends.sort(key=lambda end: (look.arms[end][0][0], look.arms[end][0][1]))
    return dict(zip(ends, "abcdefghijklmnop", strict=False))


def list_readings(look: Look, most: int) -> list[Reading]:
    """Return the cheapest ways to join the ends; runs that two cables share count twice, where that was found."""
    found = _enumerate(look, look.paired, _sharing_price(look))
    if look.paired.twin:
        single = pairing_without_sharing(look)
        found += _enumerate(look, single, 0.0)
    found.sort(key=lambda reading: reading.cost)
    kept: dict[tuple[object, ...], Reading] = {}
    for reading in found:
        kept.setdefault((reading.pairs, reading.open_ends, reading.shared), reading)
    return list(kept.values())[:most]


def pairing_without_sharing(look: Look) -> Pairing:
    """Return the pairing cut to the runs of the graph, each once; its partners are not to be used."""
    n = look.graph.runs
    full = look.paired
    nodes, arms = look.graph.nodes.tolist(), look.graph.arms
    return Pairing(
        full.points,
        full.radius,
        full.original[:n],
        nodes,
        full.price[: 2 * n],
        full.spans[:n],
        full.spurs[:n],
        arms,
        [],
        [],
        [],
        [],
        {},
    )


def readings(look: Look) -> str:
    """Return a table in Markdown of the cheapest readings."""
    head = ["| reading | cost |", "| --- | ---: |"]
    shares = bool(look.paired.twin)
    rows = []
    for k, reading in enumerate(list_readings(look, 3)):
        how = (" (shared run counted twice)" if reading.shared else " (each run once)") if shares else ""
        rows.append(f"| {'**' if k == 0 else ''}{reading}{'**' if k == 0 else ''}{how} | {reading.cost:.2f} |")
    ways = [f"{a} goes on in {b}" for a, b in lanes_of(look)]
    return "\n".join(head + rows + (["", f"In the shared run: {', '.join(ways)}."] if ways else []))


def lanes_of(look: Look) -> list[tuple[str, str]]:
    """Return the ends before and behind the runs that two cables share, as the lanes have joined them."""
    names, settled, identity = names_of(look), look.settled, _identity(look.settled)
    found = []
    for start, end in enumerate(settled.partner):
        passed = False
        at = end
        while at >= 0 and at // 2 in settled.twin:
            at, passed = settled.partner[at ^ 1], True
        if passed and at > start and start // 2 not in settled.twin:
            one, other = sorted((names[int(identity[start])], names[int(identity[at])]))
            found.append((one, other))
    return sorted(found)


def joints_block(look: Look) -> str:
    """Return what `Detection.joints` says, as text."""
    lines = ["```"]
    for cable, detection in enumerate(look.detections):
        for joint in detection.joints:
            to = ", ".join("open" if p is None else f"({p[0]:.0f}, {p[1]:.0f})" for p in joint.alternatives)
            span = f"u {joint.u[0]:.2f} to {joint.u[1]:.2f}"
            figures = f"cost {joint.cost:.2f}, margin {joint.margin:.2f}, confidence {joint.confidence:.2f}"
            lines.append(f"cable {cable}: {joint.kind.value:8} {span}, {figures}, otherwise {to}")
    return "\n".join([*lines, "```"])


def constants() -> str:
    """Return a table in Markdown of what the code has."""
    rows = [f"| {text} | {value:g} |" for text, value in _CONSTANTS]
    return "\n".join(["| what | value |", "| --- | ---: |", *rows])


def _identity(pairing: Pairing) -> npt.NDArray[np.int64]:
    ends: npt.NDArray[np.int64] = (2 * np.array(pairing.original, np.int64)[:, None] + (0, 1)).ravel()
    return ends


def _pair_costs(look: Look, pairing: Pairing) -> tuple[npt.NDArray[np.int64], npt.NDArray[np.int64], Points, Points]:
    graph, identity = look.graph, _identity(pairing)
    config = Config().linking
    assert isinstance(config, LinkingConfig)
    mask = look.patch.posed(look.patch.pixels)
    costs: tuple[npt.NDArray[np.int64], npt.NDArray[np.int64], Points, Points] = bending.pair_costs(
        np.array(pairing.nodes),
        identity,
        np.array(pairing.spurs),
        graph.caps[identity],
        np.ascontiguousarray(pairing.arms),
        graph.width,
        mask,
        *bending.junction_costs(graph.nodes, graph.spurs, graph.arms, graph.width, mask),
        graph.bordering[identity],
        graph.corners[identity],
        config.max_gap_widths * graph.width,
        0.0,
        0.0,
    )
    return costs


def _enumerate(look: Look, pairing: Pairing, extra: float) -> list[Reading]:
    """List all ways to pair the ends that have pairs, with their costs."""
    rows, columns, costs, price = _pair_costs(look, pairing)
    names, identity = names_of(look), _identity(pairing)
    ends = sorted({int(end) for end in np.concatenate((rows, columns))})
    cost = {(int(i), int(j)): float(c) for i, j, c in zip(rows, columns, costs, strict=True)}
    found: list[Reading] = []

    def go_on(left: list[int], pairs: list[tuple[int, int]], lonely: list[int], total: float) -> None:
        if not left:
            named = sorted(tuple(sorted((names[int(identity[i])], names[int(identity[j])]))) for i, j in pairs)
            alone = sorted(names[int(identity[i])] for i in lonely if price[i] > 0.0)
            found.append(Reading(tuple((a, b) for a, b in named), tuple(alone), total + extra, bool(pairing.twin)))
            return
        i, rest = left[0], left[1:]
        go_on(rest, pairs, [*lonely, i], total + float(price[i]))
        for j in rest:
            if (i, j) in cost:
                go_on([k for k in rest if k != j], [*pairs, (i, j)], lonely, total + cost[i, j])

    go_on(ends, [], [], 0.0)
    return found


def _sharing_price(look: Look) -> float:
    """Return what sharing the runs costs by itself, where it was found."""
    shared = {run for run in look.paired.original if look.paired.original.count(run) > 1}
    if not shared:
        return 0.0
    graph, nothing = look.graph, np.empty(0, dtype=np.int64)
    mask = look.patch.posed(look.patch.pixels)
    spans = graph.spans
    reach, widths = wide_stretches.wide_reach(graph.nodes, spans, graph.radius, graph.width)
    at = bending.junction_costs(graph.nodes, graph.spurs, graph.arms, graph.width, mask)
    lengths = (spans[:, 1] - spans[:, 0]).astype(np.float64)
    paths, _, price = branch_overlap.list_paths(
        graph.nodes, graph.spurs, reach, lengths, widths, graph.width, *at, nothing, nothing
    )
    return min(float(p) for path, p in zip(paths, price, strict=True) if {e // 2 for e in path if e >= 0} == shared)
