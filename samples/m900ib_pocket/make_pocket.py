"""Writes pocket.ls: a round-cornered pocket in two levels, for a Fanuc controller.

python samples/m900ib_pocket/make_pocket.py > samples/m900ib_pocket/pocket.ls
"""

from __future__ import annotations

WIDTH, HEIGHT, CORNER = 240.0, 160.0, 30.0  # mm
LEVELS = (-2.0, -4.0)
HOME = (0, 0, 0, 0, -60, 0)  # deg, J3 counted from the level


class Listing:
    def __init__(self) -> None:
        self.lines: list[str] = []
        self.points: list[str] = []

    def say(self, text: str) -> None:
        self.lines.append(f"  {text} ;")

    def point(self, x: float, y: float, z: float, name: str = "") -> str:
        number = len(self.points) + 1
        label = f'{number}:"{name}"' if name else f"{number}"
        self.points.append(
            f"P[{label}]{{\n   GP1:\n\tUF : 1, UT : 1,\t\tCONFIG : 'N U T, 0, 0, 0',\n"
            f"\tX = {x:9.3f}  mm,\tY = {y:9.3f}  mm,\tZ = {z:9.3f}  mm,\n"
            f"\tW = {180:9.3f} deg,\tP = {0:9.3f} deg,\tR = {0:9.3f} deg\n}};"
        )
        return f"P[{number}:{name}]" if name else f"P[{number}]"

    def home(self) -> str:
        axes = [f"J{k}= {value:9.3f} deg" for k, value in enumerate(HOME, 1)]
        number = len(self.points) + 1
        rows = ",\n\t".join(",\t".join(axes[k : k + 3]) for k in (0, 3))
        self.points.append(f'P[{number}:"HOME"]{{\n   GP1:\n\tUF : 1, UT : 1,\t\n\t{rows}\n}};')
        return f"P[{number}:HOME]"

    def line(self, x: float, y: float, z: float, speed: str = "50mm/sec", corner: str = "CNT100") -> None:
        self.lines.append(f"L {self.point(x, y, z)} {speed} {corner}    ;")

    def arc(self, via: tuple[float, float], end: tuple[float, float], z: float) -> None:
        first = self.point(*via, z)
        self.lines.append(f"C {first}    \n    :  {self.point(*end, z)} 50mm/sec CNT100    ;")

    def level(self, z: float, above: str) -> None:
        """Once around, counter-clockwise."""
        w, h, r = WIDTH, HEIGHT, CORNER
        k = r * (1 - 0.5**0.5)
        self.line(w / 2, 0, z, "20mm/sec", "FINE")
        self.say("!FORCE 120 260 -60 @feed")
        self.line(w - r, 0, z)
        self.arc((w - k, k), (w, r), z)
        self.line(w, h - r, z)
        self.arc((w - k, h - k), (w - r, h), z)
        self.line(r, h, z)
        self.arc((k, h - k), (0, h - r), z)
        self.line(0, r, z)
        self.arc((k, k), (r, 0), z)
        self.line(w / 2, 0, z, corner="FINE")
        self.say("!FORCE OFF")
        self.lines.append(f"L {above} 200mm/sec FINE    ;")

    def text(self) -> str:
        main = [f"{number:4d}:{line}" for number, line in enumerate(self.lines, 1)]
        head = [
            "/PROG  POCKET", "/ATTR", "OWNER\t\t= MNEDITOR;", 'COMMENT\t\t= "Pocket";', "PROG_SIZE\t= 0;",
            "CREATE\t\t= DATE 24-01-01  TIME 12:00:00;", "MODIFIED\t= DATE 24-01-01  TIME 12:00:00;",
            "FILE_NAME\t= ;", "VERSION\t\t= 0;", f"LINE_COUNT\t= {len(self.lines)};", "MEMORY_SIZE\t= 0;",
            "PROTECT\t\t= READ_WRITE;", "TCD:  STACK_SIZE\t= 0,", "      TASK_PRIORITY\t= 50,",
            "      TIME_SLICE\t= 0,", "      BUSY_LAMP_OFF\t= 0,", "      ABORT_REQUEST\t= 0,",
            "      PAUSE_REQUEST\t= 0;", "DEFAULT_GROUP\t= 1,*,*,*,*;", "CONTROL_CODE\t= 00000000 00000000;", "/MN",
        ]  # fmt: skip
        return "\n".join([*head, *main, "/POS", *self.points, "/END"])


def program() -> str:
    listing = Listing()
    listing.say("UFRAME_NUM=1")
    listing.say("UTOOL_NUM=1")
    home = listing.home()
    above = listing.point(WIDTH / 2, HEIGHT / 2, 20, "above")
    listing.lines.append(f"J {home} 50% CNT50    ;")
    listing.lines.append(f"J {above} 50% FINE    ;")
    for z in LEVELS:
        listing.level(z, above)
    listing.lines.append(f"J {home} 50% FINE    ;")
    return listing.text()


if __name__ == "__main__":
    print(program())
