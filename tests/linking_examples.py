"""Drawings of cables that meet, and what the default method's stages make of them."""

from __future__ import annotations

import numpy as np
from drawings import draw_cable
from scipy.spatial import cKDTree

import dloftbs
from dloftbs import Config, Detection
from dloftbs.cleaning import clean
from dloftbs.config import LinkingConfig
from dloftbs.data.graph import Graph
from dloftbs.data.mask_crop import MaskCrop
from dloftbs.linking import link
from dloftbs.linking.end_matching import match_ends
from dloftbs.linking.matched_ends import EndMatching
from dloftbs.skeleton import build_graph, skeletonize

SIZE = (240, 400)


def graph_of(mask: np.ndarray) -> tuple[MaskCrop, Graph]:
    """Return the crop and the graph of a mask that has one."""
    crop = clean(mask, Config().cleaning)
    assert crop is not None
    graph, _ = build_graph(crop, skeletonize(crop), 1000)
    assert graph is not None
    return crop, graph


def matching_of(mask: np.ndarray, max_gap_widths: float = 25.0) -> tuple[MaskCrop, Graph, EndMatching]:
    """Return what comes out of the matching alone."""
    crop, graph = graph_of(mask)
    return crop, graph, match_ends(crop, graph, max_gap_widths)


def linked(mask: np.ndarray, max_gap_widths: float = 25.0) -> tuple[MaskCrop, Graph, EndMatching]:
    """Return what is ready to be assembled."""
    crop, graph = graph_of(mask)
    return crop, graph, link(crop, graph, LinkingConfig(max_gap_widths=max_gap_widths)).matching


def detect(mask: np.ndarray, **linking: object) -> list[Detection]:
    """Return what the default method finds, with some of the linking's settings changed."""
    return dloftbs.detect(mask, config=Config().replace({f"linking.{name}": value for name, value in linking.items()}))


def draw(*cables: np.ndarray, width: float = 7.0, size: tuple[int, int] = SIZE) -> np.ndarray:
    """Draw cables into one mask: what lies within half a width of a polyline, with round ends."""
    mask = np.zeros(size, dtype=np.uint8)
    for points in cables:
        near = np.argwhere(draw_cable(np.asarray(points, dtype=float), int(width) + 6, size))
        away, _ = cKDTree(dense(points, 0.25)).query(near[:, ::-1])
        mask[tuple(near[away <= 0.5 * width].T)] = 1
    return mask


def dense(points: np.ndarray, step: float = 0.5) -> np.ndarray:
    """Return points on a polyline, about every `step` px."""
    at = np.r_[0.0, np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))]
    fine = np.linspace(0.0, at[-1], int(at[-1] / step) + 2)
    return np.column_stack([np.interp(fine, at, axis) for axis in np.asarray(points, dtype=float).T])


def cross(angle_deg: float, length: float = 300.0, centre: tuple[float, float] = (200.0, 120.0)) -> list[np.ndarray]:
    """Return two straight cables that cross in their middle, mirrored about a slightly tilted axis."""
    half = np.radians(angle_deg / 2)
    tilt = np.radians(7.0)
    arms = [np.array([np.cos(tilt + a), np.sin(tilt + a)]) * length / 2 for a in (half, -half)]
    return [np.array([centre - arm, centre + arm]) for arm in arms]


def beside(length: float, width: float, crosses: bool, size: tuple[int, int] = SIZE) -> list[np.ndarray]:
    """Return two cables that come together, lie side by side over some length, and part again.

    Their axes are one width apart there; where they cross, they do so in the middle of it.
    """
    x = np.linspace(0.05 * size[1], 0.95 * size[1], 400)
    middle = 0.5 * size[1]
    away = np.maximum(np.abs(x - middle) - 0.5 * length, 0.0)
    apart = 0.5 * width + 0.25 * size[0] * (1.0 - np.exp(-((away / (6.0 * width)) ** 2)))
    side = np.tanh((x - middle) / (1.2 * width)) if crosses else np.ones_like(x)
    y = 0.5 * size[0] + 0.03 * (x - middle)
    return [np.column_stack((x, y + side * apart)), np.column_stack((x, y - side * apart))]


def circle(centre: tuple[float, float], radius: float, start: float = 0.0, stop: float = 2 * np.pi) -> np.ndarray:
    """Return points along a circle, or a part of it."""
    angle = np.linspace(start, stop, 300)
    return np.column_stack((centre[0] + radius * np.cos(angle), centre[1] + radius * np.sin(angle)))


def distances(detections: list[Detection], truth: list[np.ndarray]) -> list[float]:
    """Return for each true cable how far it is from the curve that is most like it, at most and both ways, px."""
    found = [dense(detection.curve.sample(600)) for detection in detections]
    result = []
    for points in map(dense, truth):
        both = [max(cKDTree(points).query(one)[0].max(), cKDTree(one).query(points)[0].max()) for one in found]
        result.append(float(min(both)))
    return result


def coil(radius: float = 50.0) -> np.ndarray:
    """Return a cable from the left to the right with one full turn on the way, which touches itself at (200, 180)."""
    turn, way = np.linspace(0.0, 2.0 * np.pi, 200), np.linspace(0.0, 1.0, 60)
    left = np.column_stack((20 + 180 * way, 165 + 15 * np.sin(way * np.pi / 2)))
    ring = np.column_stack((200 + radius * np.sin(turn), 180 - radius + radius * np.cos(turn)))
    right = np.column_stack((200 + 180 * way, 165 + 15 * np.cos(way * np.pi / 2)))
    return np.concatenate((left, ring[1:-1], right))


def hide(mask: np.ndarray, x: float, y: float, radius: float) -> np.ndarray:
    """Return a mask of which a disc hides a part."""
    yy, xx = np.indices(mask.shape)
    return np.where(np.hypot(xx - x, yy - y) < radius, 0, mask)
