"""Random statements with what real programs hold beside the common forms.

further  = record | grid | axes | words | function | with | retract | frames | point | rounded | radix
record   = an array of structures: a component, a point, a whole structure; copies of structures
grid     = an array of two dimensions
axes     = variables of axis angles, of which single ones are set
words    = ENUM: a variable, IF and SWITCH on it, also where inputs decide
function = a FRAME or REAL that a function of the module returns, in points, assignments and other calls
with     = a motion of its own speed, base or tool: WITH
retract  = a point that is $POS_ACT, moved
frames   = $BASE=$BASE:{..}, variables that take $BASE, a table entry; products of three
point    = a point of the .dat or $config.dat that the program moves
rounded  = an INT gets a REAL; a REAL where a call wants an INT
radix    = numbers in hex and binary, B_OR, B_EXOR, B_NOT, comparisons of REAL
"""

from __future__ import annotations

from abc import abstractmethod

from .later import Later

WORDS = ("#red", "#green", "#blue")


class Further(Later):
    has_frame_function = False

    @abstractmethod
    def inner(self, depth: int) -> list[str]: ...

    def further_data(self) -> list[str]:
        """Of the .dat, behind STRUC jobtype."""
        rng = self.rng
        out = ["ENUM colour red,green,blue", f"DECL colour shade={rng.choice(WORDS)}", "DECL jobtype jobs[2]"]
        out += [
            f"jobs[{n}]={{P {self.aggregate(plain=True)},count {rng.randint(0, 4)},width {rng.randint(0, 9)}}}"
            for n in (1, 2)
        ]
        out.append("DECL FRAME grid[2,2]")
        out += [f"grid[{m},{n}]={self.aggregate(plain=True)}" for m in (1, 2) for n in (1, 2)]
        axes = ",".join(f"A{k} {self.number(-80, 80)}" for k in range(1, 7))
        out.append(f"DECL E6AXIS XA1={{{axes},E1 0.0,E2 0.0,E3 0.0,E4 0.0,E5 0.0,E6 0.0}}")
        return [*out, f"DECL CONST INT fixed={rng.randint(1, 4)}"]

    def further_locals(self) -> tuple[list[str], list[str]]:
        """Declarations, and what gives them their first values."""
        axes = ",".join(f"A{k} {self.number(-80, 80)}" for k in range(1, 7))
        first = [f"ax={{{axes}}}", f"c={self.rng.choice(WORDS)}"]
        return [f"DECL {self.rng.choice(['AXIS', 'E6AXIS'])} ax", "DECL colour c"], first

    def functions(self) -> list[str]:
        """What the functions do beside what they return."""
        rng = self.rng
        does = rng.choice([[], [], ["mi=mi+1"], ["XP1.X=XP1.X+1"], ["$BASE=BASE_DATA[3]"], ["v=v+1"]])
        early = rng.choice([[], [f"IF v>{rng.randint(0, 4)} THEN", f"RETURN {{{self._six()}}}", "ENDIF"]])
        return [
            "DEFFCT FRAME placed(v:IN)", "INT v", "FRAME p", f"p={{{self._six()}}}", *early, *does,
            f"p.{rng.choice('XYZ')}=v*10", "RETURN p", "ENDFCT",
            f"DEFFCT REAL height(v:{rng.choice(['IN', 'IN', 'OUT'])})", "INT v", *rng.choice([[], ["v=v*2"]]),
            "RETURN v+0.5", "ENDFCT",
        ]  # fmt: skip

    def _six(self) -> str:
        return (
            self.aggregate(plain=True).replace("FRAME: ", "").replace("POS: ", "")[1:-1].partition(",S ")[0]
        )

    def further(self, depth: int) -> list[str]:
        names = self.names
        if not names.ints or not names.reals or not names.frames:
            return self.motion()
        kinds = [
            self.record, self.record, self.grid, self.axes, self.words, self.words, self.own_settings, self.retract,
            self.frames, self.point, self.rounded, self.radix,
        ]  # fmt: skip
        if self.has_frame_function:
            kinds += [self.function, self.function]
        return self.rng.choice(kinds)(depth)

    def _index(self) -> str:
        """1 or 2."""
        rng = self.rng
        if rng.random() < 0.6:
            return str(rng.randint(1, 2))
        return f"({self.whole(1)} B_AND 1)+1"

    def record(self, depth: int) -> list[str]:
        rng, n = self.rng, self._index()
        plain = self.aggregate("YZABC", plain=True)[1:]
        return rng.choice(
            [
                [f"jobs[{n}].P.{rng.choice('XYZA')}={self.real()}"],
                [f"jobs[{n}].P={self.frame_value()}", f"LIN jobs[{rng.randint(1, 2)}].P"],
                [f"jobs[{n}].count={self.whole()}", f"{rng.choice(self.names.ints)}=jobs[1].count"],
                [f"jobs[{n}].count={self.real()}", f"{rng.choice(self.names.ints)}=jobs[{n}].count/2"],
                [f"job.width={rng.randint(0, 9)}", f"LIN {{X job.width/2,{plain}"],
                [f"LIN {{X {rng.choice(['mr', 'jobs[2].width', 'job.width'])}/2,{plain}"],
                [f"LIN jobs[{n}].P{rng.choice(['', ' C_DIS'])}"],
                ["job=jobs[1]", "LIN job.P"],
                [f"jobs[{n}]=job", "LIN jobs[2].P"],
                [f"{rng.choice(self.names.frames)}=jobs[{n}].P"],
                [f"LIN jobs[{n}].P:{self.aggregate(plain=True)}"],
            ]
        )

    def grid(self, depth: int) -> list[str]:
        rng = self.rng
        place = f"grid[{self._index()},{self._index()}]"
        return rng.choice(
            [[f"{place}={self.frame_value()}"], [f"{place}.X={self.real()}"], [f"LIN {place}"], [f"PTP {place}"],
             [f"{place}={self.frame_value()}", f"LIN grid[{rng.randint(1, 2)},{rng.randint(1, 2)}]"]]
        )  # fmt: skip

    def axes(self, depth: int) -> list[str]:
        rng = self.rng
        some = ",".join(f"A{k} {self.number(-80, 80)}" for k in sorted(rng.sample(range(1, 7), 3)))
        partial = [f"LIN {self.aggregate('XZ', plain=True)}"] * (rng.random() < 0.4)
        return rng.choice(
            [
                [f"ax.A{rng.randint(1, 6)}={self.real()}", "PTP ax"],
                [f"ax={{{some}}}", f"ax.A{rng.randint(1, 6)}={self.number(-80, 80)}", "PTP ax"],
                ["PTP ax", *partial],
                ["PTP XA1", f"PTP {{{some}}}", *partial],
                [f"XA1.A{rng.randint(1, 6)}={self.number(-80, 80)}", "PTP XA1"],
                ["PTP XA1 C_PTP", "LIN f"],
                [f"{rng.choice(self.names.reals)}=ax.A{rng.randint(1, 6)}", *self.probe()],
            ]
        )

    def words(self, depth: int) -> list[str]:
        rng = self.rng
        name, word = rng.choice(["c", "c", "shade"]), rng.choice(WORDS)
        given = [f"{name}={word}"]
        if rng.random() < 0.4:
            given = [f"IF {self.condition()} THEN", *given, "ENDIF"]
        if depth > 2 or rng.random() < 0.3:
            return given
        if rng.random() < 0.5:
            tail = ["ELSE", *self.inner(depth)] if rng.random() < 0.5 else []
            asked = f"{name}{rng.choice(['==', '<>'])}{rng.choice(WORDS)}"
            return [*given, f"IF {asked} THEN", *self.inner(depth), *tail, "ENDIF", *self.probe()]
        out = [*given, f"SWITCH {name}"]
        for case in rng.sample([*WORDS, "#red,#blue"], rng.randint(1, 3)):
            out += [f"CASE {case}", *self.inner(depth)]
        out += ["DEFAULT", *self.inner(depth)] if rng.random() < 0.5 else []
        return [*out, "ENDSWITCH", *self.probe()]

    def function(self, depth: int) -> list[str]:
        rng, names = self.rng, self.names
        plain = self.aggregate("YZABC", plain=True)[1:]
        call = f"placed({self.whole()})"
        number = f"height({rng.choice([*names.ints, *names.ints, '3'])})"
        return rng.choice(
            [[f"LIN {call}"], [f"{rng.choice(names.frames)}={call}", *self.probe()], [f"LIN {{X {number},{plain}"],
             [f"{rng.choice(names.reals)}={number}", *self.probe()], [f"LIN {call}:{self.aggregate(plain=True)}"],
             [f"{rng.choice(names.frames)}.Y={number}*2", *self.probe()], [f"list[1]={call}", "LIN list[1]"]]
        )  # fmt: skip

    def own_settings(self, depth: int) -> list[str]:
        rng = self.rng
        settings = rng.sample(
            ["$VEL.CP=0.2", f"$BASE=BASE_DATA[{rng.randint(1, 4)}]", "$TOOL=TOOL_DATA[2]", "$ORI_TYPE=#VAR",
             f"$BASE={self.aggregate(plain=True)}", f"$APO.CDIS={rng.randint(1, 9)}"], rng.randint(1, 2)
        )  # fmt: skip
        if len({one.partition("=")[0] for one in settings}) < len(settings):
            settings.pop()
        return [f"SLIN {self.target()} WITH {','.join(settings)}", *self.probe()]

    def retract(self, depth: int) -> list[str]:
        rng, f = self.rng, self.rng.choice(self.names.frames)
        moved = [f"{f}.Z={f}.Z+{rng.randint(1, 50)}"] * (rng.random() < 0.7)
        return [f"{f}=$POS_ACT", *moved, f"LIN {f}", *self.probe()]

    def frames(self, depth: int) -> list[str]:
        rng, names = self.rng, self.names
        f, n = rng.choice(names.frames), rng.randint(1, 4)
        small = self.aggregate(plain=True)
        return rng.choice(
            [[f"$BASE=$BASE:{small}"], [f"{f}=$BASE", f"$BASE={f}:{small}"], [f"{f}=BASE_DATA[{n}]", f"{f}.X=5"],
             [f"$BASE={f}:BASE_DATA[{n}]"], [f"BASE_DATA[{n}]=$BASE", f"$BASE=BASE_DATA[{n}]"],
             [f"$TOOL=$TOOL:{small}"], [f"LIN {f}:{small}:{rng.choice(names.frames)}"],
             [f"LIN ({f}:{small})"], [f"BASE_DATA[{n}]=BASE_DATA[{rng.randint(1, 4)}]:{small}"],
             [f"TOOL_DATA[{n}]=TOOL_DATA[{rng.randint(1, 4)}]", f"$TOOL=TOOL_DATA[{n}]"]]
        ) + self.probe()  # fmt: skip

    def point(self, depth: int) -> list[str]:
        rng = self.rng
        name = rng.choice(["XP1", "XP2", "XP3", "XC1"])
        return rng.choice(
            [[f"{name}.{rng.choice('XYZ')}={self.real()}", f"LIN {name}"], [f"LIN {name}"],
             [f"{name}.Z={name}.Z+5", f"LIN {name}", f"{name}.Z={name}.Z-5"],
             [f"{name}={self.aggregate(plain=True)}", f"LIN {name}"], [f"{rng.choice(self.names.frames)}={name}"]]
        )  # fmt: skip

    def rounded(self, depth: int) -> list[str]:
        name = self.rng.choice(self.names.ints)
        plain = self.aggregate("YZABC", plain=True)[1:]
        return [f"{name}={self.real()}", f"LIN {{X {name},{plain}"]

    def radix(self, depth: int) -> list[str]:
        rng, names = self.rng, self.names
        one = rng.choice(["'H1F'", "'B101'", "'HA'", self.whole(1), "fixed"])
        value = rng.choice(
            [one, f"{one} B_OR {self.whole(1)}", f"({one}) B_EXOR ({self.whole(1)})", f"B_NOT {one}"]
        )
        asked = f"{rng.choice(names.reals)}{rng.choice(['<', '>', '<=', '>='])}{self.real(1)}"
        name = rng.choice(names.ints)
        return rng.choice(
            [[f"{name}={value}", *self.probe()], [f"IF {asked} THEN", *self.assignment(), "ENDIF", *self.probe()],
             [f"b={asked}", f"b=NOT b {rng.choice(['AND', 'OR', 'EXOR'])} ({asked})"]]
        )  # fmt: skip

    @abstractmethod
    def assignment(self) -> list[str]: ...
