"""Walls by the definition of their shapes, without LAMMPS's regions.

A shape is a dictionary that JSON can hold:

- `kind`: block, sphere, plane, cylinder, cone or prism; its parameters are those of the region
  command, with lists for points; `inside`: whether the spheres are inside (True) or outside
- `number`: that of its first wall; `command`: what makes the region in LAMMPS
- `velocity`, `swing`, `period`, `turn`, `axis`, `point`: how it moves with the time t. It is turned
  by turn * t about the axis through the point, then displaced by velocity * t
  + swing * sin(2 pi t / period). All may be missing.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise, product
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial.transform import Rotation

FloatArray = NDArray[np.float64]
Shape = dict[str, Any]
AXES = "xyz"


@dataclass(frozen=True, eq=False)
class View:
    """One wall seen from some points.

    Attributes
    ----------
    number : of the wall, from 1
    distance : from each point to the wall, (n,), length; negative beyond it
    normal : unit vectors from the wall to the point, (n, 3)
    curved : whether the wall is concave, so that its tangent planes are not exact
    """

    number: int
    distance: FloatArray
    normal: FloatArray
    curved: bool


def moves(shape: Shape) -> bool:
    """Whether it changes with time."""
    return "velocity" in shape or "swing" in shape or "turn" in shape


def turns(shape: Shape) -> bool:
    """Whether it rotates."""
    return "turn" in shape


def placed(shape: Shape, time: float) -> tuple[FloatArray, Rotation]:
    """Return the displacement, and the rotation about the shape's point, at a time."""
    shift = np.array(shape.get("velocity", (0, 0, 0)), dtype=float) * time
    if "swing" in shape:
        shift += np.array(shape["swing"]) * np.sin(2 * np.pi * time / shape["period"])
    axis = np.array(shape.get("axis", (0, 0, 1)), dtype=float)
    angle = shape.get("turn", 0.0) * time
    return shift, Rotation.from_rotvec(angle * axis / np.linalg.norm(axis))


def views(shape: Shape, points: ArrayLike, time: float) -> list[View]:
    """Return every wall of a shape as it stands at a time, seen from points (n, 3)."""
    x = np.atleast_2d(np.asarray(points, dtype=float))
    # Most walls stand, and to place them takes longer than to see them.
    if not moves(shape):
        return _seen(shape, x)
    shift, rotation = placed(shape, time)
    about = np.array(shape.get("point", (0, 0, 0)), dtype=float)
    found = _seen(shape, rotation.inv().apply(x - shift - about) + about)
    return [
        View(view.number, view.distance, rotation.apply(np.array(view.normal)), view.curved)
        for view in found
    ]


def _seen(shape: Shape, x: FloatArray) -> list[View]:
    return _inside(shape, x) if shape["inside"] else [_outside(shape, x)]


def _inside(shape: Shape, x: FloatArray) -> list[View]:
    first = shape["number"]
    if shape["kind"] == "sphere":
        away = x - shape["centre"]
        length = np.linalg.norm(away, axis=1)
        return [View(first, shape["radius"] - length, -away / _safe(length), True)]
    if shape["kind"] in ("cylinder", "cone"):
        return _tube(shape, x)
    planes = _planes(shape)
    return [
        View(first + k, (x - point) @ normal, np.broadcast_to(normal, x.shape), False)
        for k, (point, normal) in enumerate(planes)
        if np.isfinite(point).all()
    ]


def _safe(length: FloatArray) -> FloatArray:
    return np.maximum(length, 1e-300)[:, None]


def _planes(shape: Shape) -> list[tuple[FloatArray, FloatArray]]:
    """A point of each plane and the normal into the shape, in the order of the walls."""
    if shape["kind"] == "plane":
        normal = np.array(shape["normal"], dtype=float)
        return [(np.array(shape["through"], dtype=float), normal / np.linalg.norm(normal))]
    if shape["kind"] == "block":
        found = []
        for axis, side in product(range(3), range(2)):
            point, normal = np.zeros(3), np.zeros(3)
            point[axis] = shape["faces"][axis][side]
            normal[axis] = 1.0 - 2.0 * side
            found.append((point, normal))
        return found
    origin, edges = _parallelepiped(shape)
    found = []
    # The faces normal to z, y, x before tilting.
    for axis in (2, 1, 0):
        normal = np.cross(edges[(axis + 1) % 3], edges[(axis + 2) % 3])
        normal /= np.linalg.norm(normal)
        found += [(origin, normal), (origin + edges[axis], -normal)]
    return found


def _parallelepiped(shape: Shape) -> tuple[FloatArray, FloatArray]:
    faces = np.array(shape["faces"], dtype=float)
    xy, xz, yz = shape.get("tilt", (0.0, 0.0, 0.0))
    size = faces[:, 1] - faces[:, 0]
    return faces[:, 0], np.array([[size[0], 0, 0], [xy, size[1], 0], [xz, yz, size[2]]])


def _tube_coordinates(shape: Shape, x: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Distance from the axis, place along it, and the unit vectors away from it."""
    axis = AXES.index(shape["axis_name"])
    away = x.copy()
    away[:, axis] = 0.0
    for coordinate, value in zip([a for a in range(3) if a != axis], shape["centre"], strict=True):
        away[:, coordinate] -= value
    rho = np.linalg.norm(away, axis=1)
    return rho, x[:, axis], away / _safe(rho)


def _ends(shape: Shape) -> tuple[float, float, float, float]:
    """Place and radius of the lower and the upper end."""
    low, high = shape["ends"]
    radii = shape["radii"] if shape["kind"] == "cone" else [shape["radius"]] * 2
    return low, high, radii[0], radii[1]


def _tube(shape: Shape, x: FloatArray) -> list[View]:
    rho, z, outward = _tube_coordinates(shape, x)
    low, high, at_low, at_high = _ends(shape)
    along = np.eye(3)[AXES.index(shape["axis_name"])]
    slope = (at_high - at_low) / (high - low) if np.isfinite([low, high]).all() else 0.0
    start = low if np.isfinite(low) else 0.0
    steep = np.hypot(1.0, slope)
    first = shape["number"]
    found = []
    if np.isfinite(low):
        found.append(View(first, z - low, np.broadcast_to(along, x.shape), False))
    if np.isfinite(high):
        found.append(View(first + 1, high - z, np.broadcast_to(-along, x.shape), False))
    side = (at_low + slope * (z - start) - rho) / steep
    found.append(View(first + 2, side, (slope * along - outward) / steep, True))
    return found


def _outside(shape: Shape, x: FloatArray) -> View:
    """Seen from outside of a convex solid: the nearest point of its surface."""
    if shape["kind"] == "sphere":
        away = x - shape["centre"]
        length = np.linalg.norm(away, axis=1)
        return View(shape["number"], length - shape["radius"], away / _safe(length), False)
    if shape["kind"] in ("cylinder", "cone"):
        nearest = _nearest_of_tube(shape, x)
    elif shape["kind"] == "block":
        faces = np.array(shape["faces"], dtype=float)
        nearest = np.clip(x, faces[:, 0], faces[:, 1])
    else:
        nearest = _nearest_of_parallelepiped(shape, x)
    away = x - nearest
    length = np.linalg.norm(away, axis=1)
    # From the inside nothing is seen: a distance of 0 is an overlap of a whole radius.
    return View(shape["number"], length, away / _safe(length), False)


def _nearest_of_tube(shape: Shape, x: FloatArray) -> FloatArray:
    """The nearest point of the trapezium that makes the solid when it turns about the axis."""
    rho, z, outward = _tube_coordinates(shape, x)
    low, high, at_low, at_high = _ends(shape)
    axis = AXES.index(shape["axis_name"])
    here = np.stack([rho, z], axis=1)
    corners = np.array([[0.0, low], [at_low, low], [at_high, high], [0.0, high]])
    slope = (at_high - at_low) / (high - low)
    inside = (z >= low) & (z <= high) & (rho <= at_low + slope * (z - low))
    best = here.copy()
    closest = np.where(inside, 0.0, np.inf)
    for start, end in pairwise(corners):
        edge = end - start
        part = np.clip((here - start) @ edge / max(float(edge @ edge), 1e-300), 0.0, 1.0)
        point = start + part[:, None] * edge
        distance = np.linalg.norm(here - point, axis=1)
        nearer = distance < closest
        best[nearer], closest = point[nearer], np.minimum(distance, closest)
    centre = np.zeros(3)
    centre[[a for a in range(3) if a != axis]] = shape["centre"]
    nearest = centre + best[:, :1] * outward
    nearest[:, axis] = best[:, 1]
    return nearest


def _nearest_of_parallelepiped(shape: Shape, x: FloatArray) -> FloatArray:
    """Least distance over the inside, faces, edges and corners: each coordinate free, 0 or 1."""
    origin, edges = _parallelepiped(shape)
    best = np.zeros_like(x)
    closest = np.full(len(x), np.inf)
    for held in product((None, 0.0, 1.0), repeat=3):
        part = np.tile([0.0 if h is None else h for h in held], (len(x), 1))
        free = [k for k, h in enumerate(held) if h is None]
        if free:
            rest = x - origin - part @ edges
            part[:, free] = np.linalg.lstsq(edges[free].T, rest.T, rcond=None)[0].T
        point = origin + part @ edges
        allowed = ((part >= -1e-12) & (part <= 1 + 1e-12)).all(axis=1)
        distance = np.where(allowed, np.linalg.norm(x - point, axis=1), np.inf)
        nearer = distance < closest
        best[nearer], closest = point[nearer], np.minimum(distance, closest)
    return best
