"""Draws TP programs: motions in jumps, loops, branches, with registers, frames and comments."""

from __future__ import annotations


class TpWriter:
    def __init__(self, random) -> None:
        self.random = random
        self.lines: list[str] = []
        self.labels: list[int] = []
        self.wanted: list[int] = []
        self.depth = 0

    def program(self) -> str:
        self.lines = ["  UFRAME_NUM=1", "  UTOOL_NUM=1", "J P[1] 50% FINE"]
        self.lines += [line for line in ("  R[1]=20", "  R[3]=1") if self.random.random() < 0.5]
        for _ in range(int(self.random.integers(4, 12))):
            self._statement()
        for label in self.wanted:
            if label not in self.labels:
                self.lines.append(f"  LBL[{label}]")
                self.labels.append(label)
                self.motion()
        text = "".join(f"{n:4d}:{line} ;\n" for n, line in enumerate(self.lines, 1))
        points = "".join(self.point(n) for n in range(1, 10))
        return f"/PROG DRAWN\n/ATTR\nLINE_COUNT\t= {len(self.lines)};\n/MN\n{text}/POS\n{points}/END\n"

    def point(self, n: int) -> str:
        draw = self.random.uniform
        if n == 1:
            values = ",".join(f"J{k}= {draw(-90, 90):.3f} deg" for k in range(1, 7))
            return f"P[1]{{\n   GP1:\n UF : 1, UT : 1,\n {values}\n}};\n"
        base = 2 if n == 9 else 1
        place = ",\t".join(f"{word} = {draw(0, 500):.3f}  mm" for word in "XYZ")
        turn = ",\t".join(
            f"{word} = {value:.3f} deg" for word, value in zip("WPR", (180, 0, 30), strict=True)
        )
        return f"P[{n}]{{\n   GP1:\n\tUF : {base}, UT : 1,\t\tCONFIG : 'N U T, 0, 0, 0',\n\t{place},\n\t{turn}\n}};\n"

    def pick(self, *some: str) -> str:
        return some[int(self.random.integers(len(some)))]

    def _number(self, low: int, high: int) -> int:
        return int(self.random.integers(low, high))

    def motion(self) -> None:
        speed = self.pick("50mm/sec", "300cm/min", "R[1]mm/sec", "R[2]mm/sec", "40inch/min")
        corner = self.pick("FINE", "CNT100", "CR10")
        more = " Offset,PR[1]" if self.random.random() < 0.05 else self.pick("", " ACC80")
        if self.random.random() < 0.2:
            self.lines.append(
                f"C P[{self._number(2, 9)}]    \n    :  P[{self._number(2, 9)}] {speed} {corner}{more}"
            )
        elif self.random.random() < 0.1:
            self.lines.append(f"J P[{self._number(1, 9)}] 50% {corner}")
        else:
            self.lines.append(f"L P[{self._number(2, 10)}] {speed} {corner}{more}")

    def _statement(self) -> None:
        draw = self.random.random()
        if draw < 0.45 or self.depth > 2:
            self.motion()
        elif draw < 0.62:
            self.setting()
        elif draw < 0.72:
            self._jump()
        elif draw < 0.82:
            self._block()
        elif draw < 0.9:
            self._loop()
        elif draw < 0.94:
            self._select()
        else:
            self.lines.append("  " + self.pick("CALL OTHER", "P[3]=PR[1]", "Weave Sine[1]", "Weave End"))

    def setting(self) -> None:
        self.lines.append(
            "  "
            + self.pick(
                f"R[1]={self._number(1, 90)}", "R[2]=R[1]+5", "R[1]=R[1]*2", "R[3]=1", "OVERRIDE=50%",
                f"!FORCE {self._number(1, 9)} 2 3", "//FORCE 7 8 9", "!other words", "UFRAME_NUM=2", "UFRAME_NUM=1",
                "UFRAME_NUM=R[3]",
            )
        )  # fmt: skip

    def _condition(self) -> str:
        return self.pick("DI[1]=ON", "R[3]=1", "R[1]>40", "R[3]<>1", "R[9]=2")

    def label(self) -> int:
        if self.labels and self.random.random() < 0.5:
            return int(self.random.choice(self.labels))
        label = len(self.labels) + len(self.wanted) + 10
        self.wanted.append(label)
        return label

    def _jump(self) -> None:
        if self.depth == 0 and self.random.random() < 0.4:
            label = next((one for one in self.wanted if one not in self.labels), 100 + len(self.labels))
            self.labels.append(label)
            self.lines.append(f"  LBL[{label}]")
            return
        action = self.pick("JMP", "JMP", "set", "END") if self.depth == 0 else "set"
        words = {
            "JMP": f"JMP LBL[{self.label()}]" if action == "JMP" else "",
            "set": "R[1]=7",
            "END": "END",
        }[action]
        self.lines.append(f"  IF {self._condition()},{words}")

    def _block(self) -> None:
        self.depth += 1
        self.lines.append(f"  IF ({self._condition()}) THEN")
        for _ in range(self._number(1, 3)):
            self._statement()
        if self.random.random() < 0.5:
            self.lines.append("  ELSE")
            for _ in range(self._number(1, 3)):
                self._statement()
        self.lines.append("  ENDIF")
        self.depth -= 1

    def _loop(self) -> None:
        self.depth += 1
        self.lines.append(f"  FOR R[{4 + self.depth}]={self._number(0, 3)} TO {self._number(0, 4)}")
        for _ in range(self._number(1, 3)):
            self._statement()
        self.lines.append("  ENDFOR")
        self.depth -= 1

    def _select(self) -> None:
        if self.depth:
            return
        self.lines.append(f"  SELECT R[9]=1,JMP LBL[{self.label()}]")
        self.lines.append(f"         =2,{self.pick('CALL OTHER', f'JMP LBL[{self.label()}]')}")


class FurtherTpWriter(TpWriter):
    """Motions with what else TP has: programs that they call beside their path, increments, skips, two groups."""

    def program(self) -> str:
        self.calls = self.random.random() < 0.3
        return super().program()

    def point(self, n: int) -> str:
        text = super().point(n).replace("P[", f"P[{n}:name" + "]{", 1).replace("]{" + f"{n}]", "]")
        if n == 8:
            text = text.replace("\n};", "\n   GP2:\n\tUF : 1, UT : 1,\n\tJ1= 5.000 deg\n};")
        return text

    def motion(self) -> None:
        before = len(self.lines)
        super().motion()
        line = self.lines[before]
        if line.startswith(("L", "C")) and "Offset" not in line and self.random.random() < 0.5:
            options = [
                " INC", " Tool_Offset,PR[2]", " TA .10sec,DO[1]=ON", " DB 5.0mm,DO[2]=OFF", " Wjnt", " COORD", " RTCP",
                " PTH", f" Skip,LBL[{self.label()}]" if self.depth == 0 else " ACC50",
            ]  # fmt: skip
            if self.calls:
                options += [" TB .20sec,CALL OTHER", " TA .20sec,CALL OTHER(1)", " DB 3.0mm,CALL OTHER"] * 2
            self.lines[before] = line + self.pick(*options)
        if self.random.random() < 0.3:
            self.lines[before] = self.lines[before].replace("P[3]", "P[3:corner]").replace("P[4]", "P[4:a b]")

    def setting(self) -> None:
        if self.random.random() < 0.7:
            super().setting()
        else:
            self.lines.append(
                "  " + self.pick("PAYLOAD[1]", "UFRAME_NUM[GP2]=2", "R[1:speed]=33", "LBL[77:end]")
                if 77 not in self.labels and self.depth == 0
                else "  R[2]=44"
            )
            if self.lines[-1].endswith("LBL[77:end]"):
                self.labels.append(77)
