"""A URDF of the KR 270 with simple collision shapes, written from its lengths."""

from __future__ import annotations

LENGTHS = {"d1": 0.75, "a1": 0.35, "a2": 1.25, "a3": -0.055, "d4": 1.1, "d6": 0.23}


def box(x: float, y: float, z: float, at: str) -> str:
    return f'<collision><origin xyz="{at}"/><geometry><box size="{x} {y} {z}"/></geometry></collision>'


def urdf_of(
    lengths: dict[str, float],
    table: str = "",
    shapes: bool = True,
    a2: float | None = None,
    wide: float = 1.0,
) -> str:
    """The arm as KUKA counts its axes; ``table``: x, y, z of the middle of a table 0.1 m thick and ``wide`` [m]."""
    d1, a1, a3, d4, d6 = (lengths[key] for key in ("d1", "a1", "a3", "d4", "d6"))
    upper = lengths["a2"] if a2 is None else a2
    joints = [
        ("0 0 -1", f"0 0 {d1}"), ("0 1 0", f"{a1} 0 0"), ("0 1 0", f"{upper} 0 0"),
        ("-1 0 0", f"0 0 {a3}"), ("0 1 0", f"{d4} 0 0"), ("-1 0 0", "0 0 0"),
    ]  # fmt: skip
    bodies = {
        0: box(0.5, 0.5, 0.3, "0 0 0.15"),
        1: box(0.6, 0.5, 0.4, "0 0 0"),
        2: box(upper, 0.25, 0.25, f"{upper / 2} 0 0"),
        3: box(0.3, 0.3, 0.3, "0 0 0"),
        4: box(0.7, 0.2, 0.2, f"{d4 - 0.45} 0 0"),
        5: box(0.1, 0.1, 0.1, "0 0 0"),
        6: box(0.1, 0.15, 0.15, f"{d6} 0 0"),
    }
    links = [f'<link name="l{k}">{body if shapes else ""}</link>' for k, body in bodies.items()]
    lines = [
        f'<joint name="A{k + 1}" type="revolute"><parent link="l{k}"/><child link="l{k + 1}"/><origin xyz="{at}"/>'
        f'<axis xyz="{axis}"/><limit lower="-7" upper="7" effort="1" velocity="1"/></joint>'
        for k, (axis, at) in enumerate(joints)
    ]
    if table:
        links.append(f'<link name="table">{box(wide, wide, 0.1, "0 0 0")}</link>')
        lines.append(
            f'<joint name="t" type="fixed"><parent link="l0"/><child link="table"/><origin xyz="{table}"/></joint>'
        )
    return f'<robot name="kr270">{"".join(links)}{"".join(lines)}</robot>\n'
