"""Writes pocket.mod: a round-cornered pocket in two levels, for an ABB controller.

python samples/irb6700_pocket/make_pocket.py > samples/irb6700_pocket/pocket.mod
"""

from __future__ import annotations

WIDTH, HEIGHT, CORNER = 240.0, 160.0, 30.0  # mm
LEVELS = (-2.0, -4.0)
DOWN = "[0,0.70710678,0.70710678,0]"
REST = "[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]"
TAIL = "tSpindle\\WObj:=wPart"


def target(x: float, y: float, z: float) -> str:
    return f"[[{x:.3f},{y:.3f},{z:.3f}],{DOWN},{REST}]"


def line(x: float, y: float, z: float, speed: str = "v50", zone: str = "z1") -> str:
    return f"    MoveL {target(x, y, z)},{speed},{zone},{TAIL};"


def arc(via: tuple[float, float], end: tuple[float, float], z: float) -> str:
    return f"    MoveC {target(*via, z)},{target(*end, z)},v50,z1,{TAIL};"


def level(z: float) -> list[str]:
    """Once around, counter-clockwise."""
    w, h, r = WIDTH, HEIGHT, CORNER
    k = r * (1 - 0.5**0.5)
    return [
        line(w / 2, 0, z, "v20"),
        "    ! FORCE 120 260 -60 @feed",
        line(w - r, 0, z),
        arc((w - k, k), (w, r), z),
        line(w, h - r, z),
        arc((w - k, h - k), (w - r, h), z),
        line(r, h, z),
        arc((k, h - k), (0, h - r), z),
        line(0, r, z),
        arc((k, k), (r, 0), z),
        line(w / 2, 0, z, zone="fine"),
        "    ! FORCE OFF",
        "    MoveL Offs(pCentre,0,0,10),v200,z1," + TAIL + ";",
    ]


def program() -> list[str]:
    lines = [
        "MODULE Pocket",
        '  TASK PERS wobjdata wPart:=[FALSE,TRUE,"",[[1600,-80,900],[1,0,0,0]],[[0,0,0],[1,0,0,0]]];',
        f"  CONST robtarget pCentre:={target(WIDTH / 2, HEIGHT / 2, 20)};",
        "  CONST jointtarget jHome:=[[0,0,0,0,60,0],[9E9,9E9,9E9,9E9,9E9,9E9]];",
        "  PROC main()",
        "    ConfL\\Off;",
        f"    MoveAbsJ jHome,v500,z50,{TAIL};",
        f"    MoveJ pCentre,v500,fine,{TAIL};",
    ]
    for z in LEVELS:
        lines += level(z)
    return [*lines, f"    MoveAbsJ jHome,v500,fine,{TAIL};", "  ENDPROC", "ENDMODULE"]


if __name__ == "__main__":
    print("\n".join(program()))
