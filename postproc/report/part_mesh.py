"""The mesh of a part with its error as colours, as PLY and GLB files."""

from __future__ import annotations

import json
import struct
from typing import TYPE_CHECKING, Any

import numpy as np

from postproc.base.arrays import Floats
from postproc.base.units import MM

if TYPE_CHECKING:
    from postproc.part.part_figures import PartError

BANDS = np.array(
    [
        [33, 64, 154, 255],  # gouge of twice the tolerance and more
        [69, 117, 180, 255],
        [145, 191, 219, 255],
        [224, 243, 248, 255],  # gouge within half of it
        [254, 224, 144, 255],  # excess within half of it
        [252, 141, 89, 255],
        [215, 48, 39, 255],
        [142, 1, 34, 255],
    ],
    np.uint8,
)
"""Colours of the error in halves of the tolerance, from gouges (blue) to excess (red)."""

PLAIN = np.array([190, 190, 190, 255], np.uint8)
"""What the program does not make."""

MESHES = ("ply", "glb")
"""Formats of the files."""


def band_colours(error: Floats, tolerance: float) -> np.ndarray[Any, np.dtype[np.uint8]]:
    """(V, 4) colours of errors (V,) [m]; NaN is plain."""
    place = np.floor(np.nan_to_num(error) / (0.5 * tolerance)) + len(BANDS) // 2
    colours = BANDS[np.clip(place, 0, len(BANDS) - 1).astype(np.int64)]
    return np.where(np.isnan(error)[:, None], PLAIN, colours)


def part_mesh(part: PartError, suffix: str) -> bytes:
    """The part as compensated, or as posted where nothing is, in one of the formats MESHES: coordinates in mm in the
    axes of the stock."""
    error = part.vertex_errors(part.after or part.before)
    vertices = (part.surface.vertices / MM).astype("<f4")
    faces = part.surface.faces.astype("<i4")
    colours = band_colours(error, part.figures.tolerance)
    if suffix == "ply":
        return _ply(vertices, faces, colours, (error / MM).astype("<f4"))
    return _glb(vertices, faces, colours)


def _ply(vertices: Any, faces: Any, colours: Any, error: Any) -> bytes:
    """A binary PLY with the error [mm] of each vertex as the property ``quality``.  Source: G. Turk, The PLY Polygon
    File Format, 1994."""
    head = (
        "ply\nformat binary_little_endian 1.0\ncomment error of the part in mm: property quality\n"
        f"element vertex {len(vertices)}\n"
        + "".join(f"property float {axis}\n" for axis in "xyz")
        + "".join(f"property uchar {name}\n" for name in ("red", "green", "blue", "alpha"))
        + f"property float quality\nelement face {len(faces)}\nproperty list uchar int vertex_indices\nend_header\n"
    )
    rows = np.empty(len(vertices), [("at", "<f4", 3), ("colour", "u1", 4), ("quality", "<f4")])
    rows["at"], rows["colour"], rows["quality"] = vertices, colours, error
    triangles = np.empty(len(faces), [("count", "u1"), ("corners", "<i4", 3)])
    triangles["count"], triangles["corners"] = 3, faces
    return head.encode() + rows.tobytes() + triangles.tobytes()


def _glb(vertices: Any, faces: Any, colours: Any) -> bytes:
    """A binary glTF, in m as the format asks, z up turned to y up.  Source: Khronos, glTF 2.0, 2021, 5 and 4.4."""
    places = np.ascontiguousarray(vertices[:, [0, 2, 1]] * np.array([MM, MM, -MM], np.float32))
    parts = [places.tobytes(), np.ascontiguousarray(colours).tobytes(), faces.astype("<u4").tobytes()]
    starts = np.cumsum([0, *map(len, parts)]).tolist()
    views = [
        {"buffer": 0, "byteOffset": start, "byteLength": len(raw), "target": 34963 if index == 2 else 34962}
        for index, (start, raw) in enumerate(zip(starts, parts, strict=False))
    ]
    low, high = places.min(axis=0).tolist(), places.max(axis=0).tolist()
    scene = {
        "asset": {"version": "2.0", "generator": "postproc"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0, "COLOR_0": 1}, "indices": 2}]}],
        "buffers": [{"byteLength": starts[-1]}],
        "bufferViews": views,
        "accessors": [
            {
                "bufferView": 0,
                "componentType": 5126,
                "count": len(places),
                "type": "VEC3",
                "min": low,
                "max": high,
            },
            {
                "bufferView": 1,
                "componentType": 5121,
                "normalized": True,
                "count": len(colours),
                "type": "VEC4",
            },
            {"bufferView": 2, "componentType": 5125, "count": faces.size, "type": "SCALAR"},
        ],
    }
    text = json.dumps(scene, separators=(",", ":")).encode()
    text += b" " * (-len(text) % 4)
    raw = b"".join(parts)
    raw += b"\0" * (-len(raw) % 4)
    size = 12 + 8 + len(text) + 8 + len(raw)
    head = struct.pack("<4sII", b"glTF", 2, size) + struct.pack("<I4s", len(text), b"JSON")
    return head + text + struct.pack("<I4s", len(raw), b"BIN\0") + raw
