"""Curves in space as meshes of tubes and as lines, and their form in PLY and OBJ files."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import accumulate

import numpy as np
import numpy.typing as npt

from dloftbs.data.curve import BSplineCurve
from dloftbs.support.arrays import FloatArray

Rgb = tuple[int, int, int]
IntArray = npt.NDArray[np.int32]

SIDES = 12
"""Of a tube: its surface lies within 3.5 % of the radius from a round one."""
_CAP_RINGS = 3
_MAX_RINGS = 2000
_MIN_RINGS = 16

_VERTEX = np.dtype(
    [
        *((name, "<f4") for name in ("x", "y", "z", "nx", "ny", "nz")),
        *((name, "u1") for name in ("red", "green", "blue")),
        ("object", "<i4"),
        ("inferred", "u1"),
    ]
)
_FACE = np.dtype([("count", "u1"), ("corners", "<i4", 3)])
_FRAME = "camera frame, metres: x right, y down, z forward"
_TYPES = {"f4": "float", "i4": "int", "u1": "uchar"}


@dataclass(frozen=True, eq=False)
class Shape:
    """One object: a closed or open surface where it has faces, else a line from point to point.

    Parameters
    ----------
    points : numpy.ndarray, shape (n, 3)
        Metres.
    normals : numpy.ndarray, shape (n, 3)
        Unit vectors outwards; of a line, zero.
    u : numpy.ndarray, shape (n,)
        The curve's parameter that each point belongs to.
    faces : numpy.ndarray, shape (m, 3)
        Corners of triangles, counterclockwise seen from outside.
    edges : numpy.ndarray, shape (k, 2)
        Ends of a line's pieces.
    """

    points: FloatArray
    normals: FloatArray
    u: FloatArray
    faces: IntArray
    edges: IntArray


@dataclass(frozen=True, eq=False)
class Item:
    """An object as it goes into a file.

    Parameters
    ----------
    name : int
        The track's id, or the detection's number.
    shape : Shape
    colour : (int, int, int)
        Red, green, blue, 0..255.
    inferred : numpy.ndarray, shape (n,), bool
        True for points that were inferred rather than measured.
    """

    name: int
    shape: Shape
    colour: Rgb
    inferred: npt.NDArray[np.bool_]


def ball(centre: FloatArray, radius_m: float) -> Shape:
    """Return a small ball of 20 faces around a point (3,)."""
    golden = 0.5 * (1.0 + 5.0**0.5)
    corners = [(0.0, a, b * golden) for a in (-1.0, 1.0) for b in (-1.0, 1.0)]
    normals = np.array([one[k:] + one[:k] for one in corners for k in range(3)]) / np.hypot(1.0, golden)
    near = np.linalg.norm(normals[:, None] - normals, axis=2) < 1.2  # of an edge: 1.05
    faces = [
        (a, b, c) for a in range(12) for b in range(a) for c in range(b) if near[a, b] and near[b, c] and near[c, a]
    ]
    outwards = [(a, b, c) if np.linalg.det(normals[[a, b, c]]) > 0.0 else (a, c, b) for a, b, c in faces]
    points = centre + radius_m * normals
    return Shape(points, normals, np.zeros(12), np.array(outwards, np.int32), np.empty((0, 2), np.int32))


def dot(centre: FloatArray) -> Shape:
    """Return a point (3,) by itself."""
    nothing = np.empty((0, 3), np.int32)
    return Shape(centre[None], np.zeros((1, 3)), np.zeros(1), nothing, nothing[:, :2])


def line(curve: BSplineCurve, spacing_m: float) -> Shape:
    """Return a curve in space as a line with a point every `spacing_m`, about."""
    u = _parameters(curve, spacing_m)
    points = curve(u)
    following = np.arange(1, len(u) + curve.closed) % len(u)
    edges = np.column_stack((np.arange(len(following)), following)).astype(np.int32)
    return Shape(points, np.zeros_like(points), u, np.empty((0, 3), np.int32), edges)


def tube(curve: BSplineCurve, radius_m: float, *, caps: bool = True) -> Shape:
    """Return the surface of a round tube about a curve in space, with a ring of points every radius, about.

    Parameters
    ----------
    curve : BSplineCurve
        In space, metres.
    radius_m : float
    caps : bool
        Whether half spheres close the ends of an open curve, so that the surface is watertight. Where the curve bends
        more tightly than the radius the surface goes through itself.

    Returns
    -------
    Shape
    """
    u = _parameters(curve, radius_m)
    centres, along = curve(u), curve.tangent(u)
    across = _transported(centres, along, curve.closed)
    lean = np.zeros(len(u))
    if caps and not curve.closed:
        rise = np.sin(0.5 * np.pi * np.arange(1, _CAP_RINGS) / _CAP_RINGS)
        first, last = np.zeros(len(rise), np.intp), np.full(len(rise), len(u) - 1)
        ring = np.concatenate((first, np.arange(len(u)), last))
        lean = np.concatenate((-rise[::-1], lean, rise))
        u, centres, along, across = u[ring], centres[ring], along[ring], across[ring]
    angle = 2.0 * np.pi * np.arange(SIDES) / SIDES
    sideways = np.cross(along, across)
    round_it = np.cos(angle)[:, None] * across[:, None] + np.sin(angle)[:, None] * sideways[:, None]
    normals = np.sqrt(1.0 - lean**2)[:, None, None] * round_it + (lean[:, None] * along)[:, None]
    points = (centres[:, None] + radius_m * normals).reshape(-1, 3)
    normals, of_ring = normals.reshape(-1, 3), np.repeat(u, SIDES)
    faces = _strips(len(u), curve.closed)
    if caps and not curve.closed:
        poles = np.stack((-along[0], along[-1]))
        faces = np.concatenate((faces, _fans(len(u))))
        points = np.concatenate((points, centres[[0, -1]] + radius_m * poles))
        normals, of_ring = np.concatenate((normals, poles)), np.concatenate((of_ring, u[[0, -1]]))
    return Shape(points, normals, of_ring, faces, np.empty((0, 2), np.int32))


def _parameters(curve: BSplineCurve, spacing_m: float) -> FloatArray:
    count = int(np.clip(np.ceil(curve.length / spacing_m), _MIN_RINGS, _MAX_RINGS))
    return np.linspace(0.0, 1.0, count, endpoint=not curve.closed)


def _strips(rings: int, closed: bool) -> IntArray:
    """Return the triangles between neighbouring rings."""
    low = np.arange(rings if closed else rings - 1)[:, None] * SIDES
    high = (low + SIDES) % (rings * SIDES)
    here, there = np.arange(SIDES), np.roll(np.arange(SIDES), -1)
    a, b, c, d = low + here, low + there, high + here, high + there
    return np.stack((a, b, c, b, d, c), axis=-1).reshape(-1, 3).astype(np.int32)


def _fans(rings: int) -> IntArray:
    """Return the triangles from the first and the last ring to the poles, the last two points."""
    here, there = np.arange(SIDES), np.roll(np.arange(SIDES), -1)
    last, pole = (rings - 1) * SIDES, np.full(SIDES, rings * SIDES)
    fans = ((pole, there, here), (pole + 1, last + here, last + there))
    return np.concatenate([np.column_stack(fan) for fan in fans]).astype(np.int32)


def _transported(points: FloatArray, tangents: FloatArray, closed: bool) -> FloatArray:
    """Return unit vectors across a curve that do not turn about it, shape (n, 3).

    By double reflection (Wang, Juettler, Zheng, Liu, Computation of rotation minimizing frames, 2008). What a loop has
    turned by when it comes back to its start is spread evenly along it.
    """
    if closed:
        points, tangents = np.concatenate((points, points[:1])), np.concatenate((tangents, tangents[:1]))
    across = np.empty_like(points)
    axis = np.eye(3)[int(np.abs(tangents[0]).argmin())]
    first = np.cross(tangents[0], axis)
    across[0] = first / np.linalg.norm(first)
    for i in range(len(points) - 1):
        chord = points[i + 1] - points[i]
        normal, tangent = _mirrored(across[i], chord), _mirrored(tangents[i], chord)
        across[i + 1] = _mirrored(normal, tangents[i + 1] - tangent)
    if not closed:
        return across
    across, last = across[:-1], across[-1]
    left = np.cross(tangents[0], across[0])
    turn = np.arctan2(last @ left, last @ across[0])
    back = -turn * np.arange(len(across)) / len(across)
    return np.cos(back)[:, None] * across + np.sin(back)[:, None] * np.cross(tangents[:-1], across)


def _mirrored(vector: FloatArray, normal: FloatArray) -> FloatArray:
    square = float(normal @ normal)
    return vector if square == 0.0 else vector - 2.0 * float(vector @ normal) / square * normal


def ply(items: Sequence[Item]) -> bytes:
    """Return objects as the content of a binary PLY file: points with normals, colours, object and inferred."""
    vertices = np.concatenate([np.empty(0, _VERTEX), *map(_vertices, items)])
    numbered = list(zip(items, _starts(items), strict=True))
    corners = np.concatenate([np.empty((0, 3)), *(item.shape.faces + start for item, start in numbered)])
    edges = np.concatenate([np.empty((0, 2)), *(item.shape.edges + start for item, start in numbered)])
    faces = np.empty(len(corners), _FACE)
    faces["count"], faces["corners"] = 3, corners
    header = ["ply", "format binary_little_endian 1.0", f"comment {_FRAME}", f"element vertex {len(vertices)}"]
    header += [f"property {_TYPES[_VERTEX[name].str[1:]]} {name}" for name in _VERTEX.names or ()]
    header += [f"element face {len(faces)}", "property list uchar int vertex_indices"]
    if len(edges):
        header += [f"element edge {len(edges)}", "property int vertex1", "property int vertex2"]
    text = "\n".join([*header, "end_header\n"]).encode()
    return text + vertices.tobytes() + faces.tobytes() + edges.astype("<i4").tobytes()


def _vertices(item: Item) -> npt.NDArray[np.void]:
    vertices = np.empty(len(item.shape.points), _VERTEX)
    columns = (*item.shape.points.T, *item.shape.normals.T, *item.colour, item.name, item.inferred)
    for name, column in zip(_VERTEX.names or (), columns, strict=True):
        vertices[name] = column
    return vertices


def obj(items: Sequence[Item]) -> bytes:
    """Return objects as the content of an OBJ file, each a named object; colours stand behind the coordinates."""
    parts = [f"# {_FRAME}\n"]
    for item, start in zip(items, _starts(items), strict=True):
        red, green, blue = (value / 255.0 for value in item.colour)
        parts.append(f"o object_{item.name}\n")
        parts += [f"v {x:.6f} {y:.6f} {z:.6f} {red:.3f} {green:.3f} {blue:.3f}\n" for x, y, z in item.shape.points]
        # Every point has a line of normals, so that both have the same numbers.
        parts += [f"vn {x:.4f} {y:.4f} {z:.4f}\n" for x, y, z in item.shape.normals]
        parts += [f"f {a}//{a} {b}//{b} {c}//{c}\n" for a, b, c in (item.shape.faces + start + 1).tolist()]
        parts += [f"l {a} {b}\n" for a, b in (item.shape.edges + start + 1).tolist()]
    return "".join(parts).encode()


def _starts(items: Sequence[Item]) -> list[int]:
    """Return the number of each object's first point."""
    return [0, *accumulate(len(item.shape.points) for item in items)][:-1]
