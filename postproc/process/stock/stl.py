"""STL files, binary and ASCII, read as closed meshes.

Source of the formats: 3D Systems, StereoLithography Interface Specification, 1989: 80 bytes of header, a count of
32 bits, 50 bytes a triangle, all little-endian; or words, of which only those after ``vertex`` count.
"""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

from postproc.base.arrays import Floats, Ints
from postproc.base.findings import Finding, Refusal
from postproc.base.read_files import read_file
from postproc.base.units import MM

LEAST, LARGEST = 1.0, 20_000.0
"""mm: a blank below or above has another unit than it seems."""

MOST_TRIANGLES = 5_000_000
_VERTEX = re.compile(rb"\bvertex\s+(\S+)\s+(\S+)\s+(\S+)", re.IGNORECASE)
_TRIANGLE = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])


def read_stl(path: Path, scale: float = 1.0) -> Floats:
    """(F, 3, 3) [m] the corners of the triangles; ``scale``: mm of its unit.  Refusal FIL001; STK002: no STL, or cut
    short; STK003: not closed; STK004: inside out; STK005: a size that no blank in mm has."""
    corners = _triangles(read_file(path), path) * (scale * MM)
    _check_size(corners, path)
    _check_closed(corners, path)
    return corners


def _triangles(raw: bytes, path: Path) -> Floats:
    count = int.from_bytes(raw[80:84], "little") if len(raw) >= 84 else -1
    if len(raw) == 84 + 50 * count:
        if not 0 < count <= MOST_TRIANGLES:
            raise _refused("STK002", f"it has {count} triangles; 1 to {MOST_TRIANGLES} are accepted", path)
        values = np.frombuffer(raw, _TRIANGLE, count, 84)["corners"].astype(float)
    elif raw[:400].lstrip().lower().startswith(b"solid"):
        try:
            numbers = np.array([[float(word) for word in found] for found in _VERTEX.findall(raw)])
        except ValueError:
            raise _refused("STK002", "a coordinate is not a number", path) from None
        facets = len(re.findall(rb"\bendfacet\b", raw, re.IGNORECASE))
        if not facets or numbers.shape != (3 * facets, 3) or b"endsolid" not in raw.lower():
            raise _refused("STK002", f"{facets} facets with {len(numbers)} corners are no whole STL", path)
        values = numbers.reshape(-1, 3, 3)
    else:
        what = (
            f"{len(raw)} bytes are no STL"
            if count < 0
            else f"{len(raw)} bytes are not those of {count} triangles"
        )
        raise _refused("STK002", what, path)
    if not np.isfinite(values).all():
        raise _refused("STK002", "a coordinate is not a number", path)
    return np.asarray(values)


def _check_size(corners: Floats, path: Path) -> None:
    size = np.ptp(corners.reshape(-1, 3), axis=0) / MM
    shown = " x ".join(f"{value:.4g}" for value in size)
    if size.max() < LEAST:
        help = "is it in metres? state stl: {file: ..., scale: 1000}"
        raise _refused("STK005", f"the blank is {shown} mm", path, help)
    if size.max() > LARGEST:
        raise _refused(
            "STK005", f"the blank is {shown} mm", path, "state its unit: stl: {file: ..., scale: 0.001}"
        )


def _check_closed(corners: Floats, path: Path) -> None:
    """Every edge has to be run through once in either direction, and the volume has to be positive."""
    _, index = np.unique(corners.reshape(-1, 3), axis=0, return_inverse=True)
    faces: Ints = index.reshape(-1, 3)
    faces = faces[(faces != np.roll(faces, 1, axis=1)).all(axis=1)]  # of no area
    edges = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]]).astype(np.int64)
    count = int(index.max()) + 1
    forward, backward = np.sort(edges[:, 0] * count + edges[:, 1]), np.sort(edges[:, 1] * count + edges[:, 0])
    if not np.array_equal(forward, backward):
        alone = np.setdiff1d(forward, backward)
        what = f"{len(alone)} edges belong to one triangle only" if len(alone) else "edges are shared wrongly"
        raise _refused("STK003", f"the mesh is not closed: {what}", path)
    origin = corners.reshape(-1, 3).mean(axis=0)
    a, b, c = (corners - origin).transpose(1, 0, 2)
    volumes = np.einsum("ni,ni->n", a, np.cross(b, c)) / 6
    volume = float(volumes.sum())
    if volume <= 0:
        what = f"its volume is {volume / MM**3:.4g} mm3: its triangles face inward"
        raise _refused("STK004", what, path)
    _check_bodies(corners, index.reshape(-1, 3), count, volumes, path)


def _check_bodies(corners: Floats, faces: Ints, count: int, volumes: Floats, path: Path) -> None:
    """A body whose triangles face inward is a cavity: it has to lie in the material of others."""
    ends = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]]])
    linked = coo_matrix((np.ones(len(ends), np.int8), (ends[:, 0], ends[:, 1])), (count, count))
    bodies, label = connected_components(linked, directed=False)
    body = label[faces[:, 0]]
    signed = np.bincount(body, volumes, bodies)
    for cavity in np.flatnonzero(signed < 0):
        inside = body == cavity
        point = corners[inside][0, 0]
        if _winds(corners[~inside], point) < 0.25:
            what = (
                f"a body at X {point[0] / MM:.6g} Y {point[1] / MM:.6g} Z {point[2] / MM:.6g} mm with the volume"
                f" {signed[cavity] / MM**3:.4g} mm3 has triangles that face inward, and is no cavity of another"
            )
            raise _refused("STK004", what, path)


def _winds(corners: Floats, point: Floats) -> float:
    """How often closed surfaces (F, 3, 3) enclose a point (3,).  Source: van Oosterom and Strackee, 1983."""
    a, b, c = (corners - point).transpose(1, 0, 2)
    la, lb, lc = (np.linalg.norm(side, axis=1) for side in (a, b, c))
    ab, bc, ca = (np.einsum("ni,ni->n", *pair) for pair in ((a, b), (b, c), (c, a)))
    over = np.einsum("ni,ni->n", a, np.cross(b, c))
    return float(np.arctan2(over, la * lb * lc + ab * lc + bc * la + ca * lb).sum() / (2 * np.pi))


def _refused(code: str, message: str, path: Path, help: str = "") -> Refusal:
    return Refusal(Finding(code, message, str(path), help=help))
