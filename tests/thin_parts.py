"""What comes back after an opening, slowly: by scipy's morphology, and by comparing each dash with each other."""

from __future__ import annotations

import math

import cv2
import numpy as np
from scipy import ndimage, special
from scipy.spatial.distance import cdist

AROUND = np.ones((3, 3), np.uint8)
BLOCK = 9
LONG = 4
THIN = 6
CHANCE = 0.001
MAX = 1000
STRAIGHT = 3.0


def opened(mask: np.ndarray, side: int = 3) -> np.ndarray:
    return cv2.morphologyEx(mask, cv2.MORPH_OPEN, np.ones((side, side), np.uint8))


def slow_fringe(mask: np.ndarray, reach: int = 1, least: int = 10) -> tuple[np.ndarray, np.ndarray]:
    """The edge and the surroundings of the thick parts: each square that fits, grown."""
    side = 2 * reach + 1
    edge, around = np.zeros(mask.shape, bool), np.zeros(mask.shape, bool)
    long = edge
    for depth, beyond in [(2 * reach, side)] + [(m, m) for m in range(side + 1, BLOCK + 1)]:
        square = np.ones((2 * depth + 1, 2 * depth + 1), np.uint8)
        core = cv2.erode(mask, square)
        if depth == 2 * reach:
            labels, count = ndimage.label(core, AROUND)
            long = np.bincount(labels.ravel(), minlength=count + 1)[labels] >= least
            parts, _ = ndimage.label(cv2.erode(mask, np.ones((side, side), np.uint8)), AROUND)
            thick = np.bincount(parts.ravel(), core.ravel() != 0)
            long |= ((thick >= least) & (THIN * thick >= np.bincount(parts.ravel())))[parts]
        core[~long] = 0
        size = 2 * (depth + beyond) + 1
        around |= cv2.dilate(core, np.ones((size, size), np.uint8)) != 0
        if depth == 2 * reach:
            edge = around.copy()
    return edge, around


class Dash:
    """The pixels of a dash by their moments."""

    def __init__(self, xy: np.ndarray, piece: int) -> None:
        self.xy, self.piece, self.centre = xy, piece, xy.mean(axis=0)
        values, vectors = np.linalg.eigh(np.cov(xy.T, bias=True)) if len(xy) > 1 else (np.zeros(2), np.eye(2))
        self.axis = vectors[:, 1]
        self.isotropic = bool(values[1] - values[0] < 1e-9)
        self.length = math.sqrt(12.0 * values[1] + 1.0)
        self.turn = math.sqrt(12.0 * max(values[0], 0.0) + 1.0) / self.length


def slow_halves(xy: np.ndarray, piece: int, least: int) -> list[Dash]:
    dash = Dash(xy, piece)
    if dash.isotropic:
        return []
    if dash.turn * dash.length <= STRAIGHT or len(xy) <= 2 * least:
        return [dash]
    along = (xy - dash.centre) @ dash.axis
    return [half for side in (along < -1e-9, along > 1e-9) for half in slow_halves(xy[side], piece, least)]


def slow_pair(one: Dash, other: Dash, least: int) -> tuple[float, int, int] | None:
    """The region of `dashes._pair`, and the ends that face each other."""
    way = other.centre - one.centre
    distance, together = float(np.linalg.norm(way)), one.length + other.length
    gap = distance - together / 2
    along, other_along = float(one.axis @ way), float(other.axis @ way)
    if not -1.0 <= gap <= min(one.length, least) + min(other.length, least) + 1e-9:
        return None
    straight = min(abs(along), abs(other_along)) / distance
    if straight < math.cos(math.pi / 4) - 1e-9:
        return None
    turn = max(math.acos(min(1.0, straight)), one.turn, other.turn)
    gap = max(gap, 1.0)
    area = gap * (2.0 + turn * (gap + together)) * min(1.0, 2.0 * turn / math.pi)
    return area, int(along > 0), int(other_along <= 0)


def slow_dashes(pieces: list[np.ndarray], least: int) -> np.ndarray:
    """Which of some pieces, (n, 2) each, lie in line with others."""
    small = sorted((len(xy) for xy in pieces if len(xy) < least), reverse=True)
    large = len(pieces) - len(small)
    sizes = [size for size in range(2, least + 1) if large + sum(n >= size for n in small) <= MAX]
    smallest = min(sizes, default=least)
    dashes = [d for k, xy in enumerate(pieces) if len(xy) >= smallest for d in slow_halves(xy, k, least)]
    found = np.zeros(len(pieces), bool)
    if len(dashes) < 2:
        return found
    centres = np.array([d.centre for d in dashes])
    reach = np.array([2.0 * min(d.length, least) + d.length for d in dashes])
    number = np.array([d.piece for d in dashes])
    near = (cdist(centres, centres) <= reach[:, None] + 1e-9) & (number[:, None] != number)
    density = near.sum(axis=1) / (np.pi * (reach + 1e-9) ** 2)
    links = []
    for i, one in enumerate(dashes):
        for j, other in enumerate(dashes[:i]):
            pair = slow_pair(one, other, least) if one.piece != other.piece else None
            if pair is not None and (near[i, j] or near[j, i]):
                links.append((pair[0] * max(density[i], density[j]), (i, pair[1]), (j, pair[2])))
    best: dict[tuple[int, int], float] = {}
    for chance, a, b in links:
        for end in (a, b):
            best[end] = min(best.get(end, math.inf), chance)
    group, evidence, joints = np.arange(len(dashes)), np.zeros(len(dashes)), np.zeros(len(dashes), int)
    for chance, a, b in links:
        if chance < 1.0 and chance <= (1.0 + 1e-9) * min(best[a], best[b]):
            one, other = group[a[0]], group[b[0]]
            if one != other:
                group[group == other] = one
                evidence[one] += evidence[other] - math.log(chance)
                joints[one] += joints[other] + 1
    for root in set(group):
        line = np.flatnonzero(group == root)
        expected = len(dashes) * special.gammaincc(joints[root], evidence[root]) if joints[root] else math.inf
        if expected <= CHANCE and sum(len(dashes[k].xy) for k in line) >= least:
            found[number[line]] = True
    return found


def joins(here: np.ndarray, kept: np.ndarray) -> bool:
    return bool(ndimage.label(ndimage.binary_dilation(here, AROUND) & (kept != 0), AROUND)[1] > 1)


def put_joints_back(lost: np.ndarray, kept: np.ndarray, least: int) -> list[np.ndarray]:
    """Label the pieces, and what each of them touches, by scipy; put small joints back, and return the others."""
    labels, count = ndimage.label(lost, AROUND)
    before, others = kept.copy(), []
    for number in range(1, count + 1):
        here = labels == number
        if here.sum() < least and joins(here, before):
            kept[here] = 1
        else:
            others.append(np.argwhere(here)[:, ::-1])
    return others


def cables(pieces: list[np.ndarray], least: int) -> list[np.ndarray]:
    found = slow_dashes(pieces, least)
    return [xy for xy, dash in zip(pieces, found, strict=True) if dash or len(xy) >= least]


def slow_open_up(mask: np.ndarray, least: int) -> np.ndarray:
    """Open a mask, and put back what is thin and no fringe."""
    kept = opened(mask)
    found = cables(put_joints_back(mask & ~kept, kept, least), least)
    if not found:
        return kept
    edge, around = slow_fringe(mask, least=least // 2)
    fringe_back = any(around[xy[:, 1], xy[:, 0]].any() for xy in found)
    if fringe_back:
        lost = mask & ~kept
        found = cables(put_joints_back(lost & ~around.astype(np.uint8), kept, least), least)
    for xy in found:
        kept[xy[:, 1], xy[:, 0]] = 1
    if not fringe_back:
        return kept
    result = kept.copy()
    labels, count = ndimage.label((lost != 0) & around, AROUND)
    for number in range(1, count + 1):
        here = labels == number
        size, touching = int(here.sum()), ndimage.binary_dilation(here, AROUND)
        if size >= LONG * least:
            back = 2 * int((here & edge).sum()) < size
        else:
            back = joins(here, kept) and (size < least or bool((touching & (kept != 0) & ~around).any()))
        result[here] |= np.uint8(back)
    return result
