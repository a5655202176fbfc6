"""Prints part.ngc: a step roughed in two levels, its floor and wall finished with 0.5 mm, a wave cut with a ball."""

import math


def rows(level):
    """Three rows at one level, from air to air."""
    for index, y in enumerate((4.0, 14.0, 24.0)):
        start, end = ((-12.0, 132.0), (132.0, -12.0))[index % 2]
        if not index:
            yield f"G0 X{start:.3f} Y{y:.3f}"
            yield f"G1 Z{level:.3f} F6000"
        else:
            yield f"G1 Y{y:.3f} F6000"
        yield f"G1 X{end:.3f} F3600"
    yield "G0 Z10."


def lines():
    yield "%"
    yield "(STEP AND WAVE)"
    yield "G21 G90 G17 G54"
    yield "T1 M6"
    yield "S12000 M3"
    yield "G0 X-20. Y4. Z30."
    yield "(ROUGHING, 0.5 STAYS ON WALL AND FLOOR)"
    yield from rows(-4.0)
    yield from rows(-7.5)
    yield "(FLOOR)"
    yield from rows(-8.0)
    yield "(WALL, AE 0.5)"
    yield "G0 X-12. Y24.5"
    yield "G1 Z-8. F6000"
    yield "G1 X110. F2400"
    yield "G2 X118. Y16.5 I0. J-8."
    yield "G0 Z30."
    yield "T2 M6"
    yield "S18000 M3"
    yield "(WAVE)"
    yield "G0 X-5. Y45. Z30."
    yield "G0 Z2."
    for index in range(6):
        y = 45.0 + 0.6 * index
        for step in range(53):  # the rows end, and the tool turns, in air
            x = -5.0 + 2.5 * (step if index % 2 == 0 else 52 - step)
            z = -0.8 - 0.4 * math.sin(math.pi * x / 40)
            yield f"G1 X{x:.3f} Y{y:.3f} Z{z:.3f} F3000"
    yield "G0 Z30."
    yield "M30"
    yield "%"


print("\n".join(lines()))
