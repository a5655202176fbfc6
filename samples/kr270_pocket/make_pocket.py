"""Writes pocket.ngc: a round-cornered pocket in three levels, as a CAM system posts it for a three-axis machine.

python samples/kr270_pocket/make_pocket.py > samples/kr270_pocket/pocket.ngc
"""

from __future__ import annotations

WIDTH, HEIGHT, CORNER = 300.0, 200.0, 40.0  # mm, of the outermost pass
STEP, PASSES = 15.0, 5
LEVELS = (-2.0, -4.0, -6.0)
FEED, PLUNGE = 1800, 400  # mm/min


def around(inset: float) -> list[str]:
    """One pass around, counter-clockwise (climb milling inside), begun in the middle of the lower side."""
    left, bottom = inset, inset
    right, top = WIDTH - inset, HEIGHT - inset
    radius = max(CORNER - inset / 2, 15.0)
    return [
        f"G1 X{right - radius:.3f} Y{bottom:.3f} F{FEED}",
        f"G3 X{right:.3f} Y{bottom + radius:.3f} I0. J{radius:.3f}",
        f"G1 Y{top - radius:.3f}",
        f"G3 X{right - radius:.3f} Y{top:.3f} I{-radius:.3f} J0.",
        f"G1 X{left + radius:.3f}",
        f"G3 X{left:.3f} Y{top - radius:.3f} R{radius:.3f}",
        f"G1 Y{bottom + radius:.3f}",
        f"G3 X{left + radius:.3f} Y{bottom:.3f} R{radius:.3f}",
        f"G1 X{WIDTH / 2:.3f}",
    ]


def program() -> list[str]:
    lines = [
        "%",
        "(POCKET 300 x 200, CORNERS 40)",
        "G21 G90 G17 G54",
        "T1 M6",
        "S9000 M3",
        f"G0 X{WIDTH / 2:.3f} Y{HEIGHT / 2:.3f} Z30.",
    ]
    for level in LEVELS:
        first = STEP * (PASSES - 1)
        lines += [
            f"(LEVEL Z{level:g})",
            "(FORCE OFF)",
            f"G0 X{WIDTH / 2:.3f} Y{first + 8:.3f} Z2.",
            f"G1 Z{level:.3f} F{PLUNGE}",
        ]
        lines.append("(FORCE 120 260 -60 @FEED)")
        for turn in range(PASSES - 1, -1, -1):
            lines += [f"G1 X{WIDTH / 2:.3f} Y{STEP * turn:.3f} F{FEED}", *around(STEP * turn)]
        lines += ["(FORCE OFF)", "G1 Z2. F3000"]
    return [*lines, "G0 Z50.", "M5", "M30", "%"]


if __name__ == "__main__":
    print("\n".join(program()))
