"""Random programs of KRL.

    program    = DEF part() declarations settings block END subprogram* event* function?
    block      = statement+
    statement  = motion | frame | assignment | if | switch | for | while | repeat | loop | call | jump | state | form
               | later | further | spline | idle
    motion     = full | partial | named | jump to axes | relative | arc; each with C_DIS, C_VEL or exact
    target     = {X .. C} of numbers, variables, expressions; a point of the .dat or $config.dat; a local frame; an
                 element; a part of a structure; frame : frame
    frame      = $BASE= / $TOOL= a number of the table (a constant, a variable), an aggregate, a variable, frame :
                 frame; BAS(#BASE,..); $BASE.X=; BASE_DATA[n]=
    assignment = a number, a truth, a frame, a component, an element; constants, expressions, and values from inputs
    if, switch = on constants, on variables, on inputs
    for        = constant bounds, STEP, or a bound from a variable that inputs decide; some set their own counter
    while ..   = a counter, or inputs, with EXIT in them
    call       = subprogram with parameters :IN and :OUT, with and without motions, that set frames or module variables;
                 what comes back is a variable, a component, an element with a computed index, a frame or speed in force
    later      = triggers and interrupts: see ``later``
    further    = what is rarer, in half of the programs: see ``further``
    spline     = SPLINE, then SPL and SLIN to full and partial points, ENDSPLINE
    jump       = IF .. THEN GOTO over what follows, or back as long as a counter or an input says
    form       = an inline form: FDAT, LDAT or PDAT, BAS(#CP_PARAMS,..), a point of the .dat
    comment    = FORCE n 0 0, FORCE OFF between any two statements, or behind one, of a half of the programs
    idle       = HALT, WAIT SEC, WAIT FOR, $OUT[n]= (all stop the advance run), behind CONTINUE or not; a comment
    state      = $VEL.CP, $APO.CDIS, $ORI_TYPE, BAS(#VEL_CP,..), $OV_PRO

Every local variable is set before it is read, as far as the flow does not skip it.  Subprograms call later ones only.
"""

from __future__ import annotations

import random
from itertools import pairwise

from .data import MODULE_FRAMES, MODULE_INTS, MODULE_REALS
from .further import Further
from .judge import Case
from .operands import INPUTS, Names
from .spelling import Spelling


class Generator(Further):
    def __init__(self, seed: int) -> None:
        super().__init__(seed)
        self.forces = random.Random(
            -1 - seed
        )  # of its own: the programs of a seed are the same without comments
        self.lines: list[str] = []
        self.labels = 0
        self.module = self.rng.random() < 0.5
        self.has_later = self.rng.random() < 0.4
        self.calm = self.has_later and self.rng.random() < 0.6
        self.has_further = self.rng.random() < 0.5

    def case(self) -> Case:
        rng = self.rng
        self.subprograms = rng.choice([0, 1, 1, 2, 3])
        self.takes_frame = [rng.choice(["", "", "IN", "OUT"]) for _ in range(self.subprograms)]
        self.event_routines = rng.choice([0, 1, 1, 2]) if self.has_later else 0
        self.has_function = rng.random() < 0.2
        self.has_frame_function = self.has_further and rng.random() < 0.5
        self.frame_type = "FRAME" if "OUT" in self.takes_frame else rng.choice(["FRAME", "POS", "E6POS"])
        if rng.random() < 0.3:
            self.lines += ["&ACCESS RVP", "&REL 1"]
        self.main()
        for number in range(1, self.subprograms + 1):
            self.subprogram(number)
        for number in range(1, self.event_routines + 1):
            self.event_routine(number)
        if self.has_function:
            does = rng.choice(
                [[], [], ["mi=mi+1"], ["BAS(#BASE,2)"], ["$TOOL=TOOL_DATA[3]"], ["LIN {Z 5}"], ["mr=v"]]
            )
            self.lines += ["DEFFCT INT twice(v:IN)", "INT v", *does, "RETURN 2*v", "ENDFCT"]
        if self.has_frame_function:
            self.lines += self.functions()
        self.lines = with_forces(self.lines, self.forces)
        spelling = Spelling(rng)
        src = "".join(spelling.line(line) + "\n" for line in self.lines)
        dat = "".join(spelling.line(line) + "\n" for line in self.dat())
        config = "".join(spelling.line(line) + "\n" for line in self.config())
        return Case(src, dat, config, self.runs())

    def runs(self) -> tuple[dict[int, tuple[bool, ...]], ...]:
        out: list[dict[int, tuple[bool, ...]]] = [
            dict.fromkeys(INPUTS, (*(shown,) * 6, not shown)) for shown in (False, True)
        ]
        for _ in range(2):
            some = [tuple(self.rng.random() < 0.5 for _ in range(self.rng.randint(1, 4))) for _ in INPUTS]
            out.append(dict(zip(INPUTS, some, strict=True)))
        return tuple(out)

    def rounding(self) -> str:
        return self.rng.choice(["", "", "", " C_DIS", " C_DIS", " C_VEL", " C_ORI"])

    def motion(self) -> list[str]:
        rng = self.rng
        kind = rng.random()
        word = rng.choice(["LIN", "LIN", "LIN", "SLIN"])
        if kind < 0.62:
            return [f"{word} {self.target()}{self.rounding()}"]
        if kind < 0.72:
            target = self.aggregate() if rng.random() < 0.6 else self.target()
            return [f"{rng.choice(['PTP', 'PTP', 'SPTP'])} {target}{rng.choice(['', ' C_PTP'])}"]
        if kind < 0.82:
            keys = range(1, 7) if rng.random() < 0.7 else sorted(rng.sample(range(1, 7), rng.randint(1, 3)))
            axes = ",".join(f"A{k} {self.number(-80, 80)}" for k in keys)
            relative = "_REL" if rng.random() < 0.15 else ""
            return [f"PTP{relative} {{{rng.choice(['', '', 'AXIS: '])}{axes}}}"]
        if kind < 0.92:
            keys = "".join(sorted(rng.sample("XYZ", rng.randint(1, 3))))
            frame = rng.choice(["", "", " #BASE", " #TOOL"])
            return [f"{word}_REL {self.aggregate(keys)}{frame}{rng.choice(['', ' C_DIS'])}"]
        return self.arc()

    def arc(self) -> list[str]:
        """Through points that are well apart."""
        rng = self.rng
        x, y, r = rng.randint(-100, 100), rng.randint(-100, 100), rng.randint(20, 80)
        z = rng.randint(0, 50)
        angle = rng.choice(["", "", f",CA {rng.choice([45, 200, -90, 400])}"])
        tail = self.rng.choice([f",Z {z}", f",Z {z},A 10,B 20,C 30", ",A 0,B 0,C 90", ""])
        begin = [f"LIN {{X {x + r},Y {y},Z {z},A {self.angle()},B {self.angle()},C 0}}"] * (
            rng.random() < 0.8
        )
        word = rng.choice(["CIRC", "CIRC", "SCIRC"])
        if rng.random() < 0.15:
            return [*begin, f"CIRC_REL {{X {r},Y {r}}},{{X {2 * r},Y 3}}{rng.choice(['', ' #TOOL'])}"]
        return [
            *begin,
            f"{word} {{X {x},Y {y + r},Z {z}}},{{X {x - r},Y {y + 3}{tail}}}{angle}{self.rounding()}",
        ]

    # statements

    def frame(self) -> list[str]:
        rng, names = self.rng, self.names
        name = rng.choice(["$BASE", "$BASE", "$TOOL"])
        table = {"$BASE": "BASE_DATA", "$TOOL": "TOOL_DATA"}[name]
        n = str(rng.randint(1, 4))
        kind = rng.random()
        if kind < 0.3:
            return [f"{name}={table}[{n}]"]
        if kind < 0.5:
            return [f"BAS(#{name[1:]},{rng.choice([n, n, n, '0'])})"]
        if kind < 0.58 and names.ints:
            i = rng.choice(names.ints)
            return (
                [f"{i}={n}", f"{name}={table}[{i}]"]
                if rng.random() < 0.5
                else [f"BAS(#{name[1:]},{i} B_AND 3)"]
            )
        if kind < 0.7:
            return [f"{name}={self.frame_value()}"]
        if kind < 0.78:
            return [f"{name}.{rng.choice('XYZA')}={self.real()}"]
        if kind < 0.88:
            value = f"={self.aggregate()}" if kind < 0.84 else f".{rng.choice('XYZ')}={self.number()}"
            return [f"{table}[{n}]{value}", *[f"{name}={table}[{n}]", *self.probe()] * (rng.random() < 0.5)]
        if kind < 0.93:
            return [f"{name}={table}[{n}]:{self.aggregate()}"]
        if kind < 0.95:
            return [rng.choice([f"$LOAD=LOAD_DATA[{n}]", f"LOAD_DATA[{n}].M={self.real()}"])]
        return [f"{name}={rng.choice(['$NULLFRAME', '$WORLD'])}" if name == "$BASE" else f"{name}=$NULLFRAME"]

    def assignment(self) -> list[str]:
        rng, names = self.rng, self.names
        kind = rng.random()
        if kind < 0.3 and names.ints:
            return [f"{rng.choice(names.ints)}={self.whole()}"]
        if kind < 0.45 and names.reals:
            return [f"{rng.choice(names.reals)}={self.real()}"]
        if kind < 0.6 and names.frames:
            return [f"{rng.choice(names.frames)}={self.frame_value()}"]
        if kind < 0.8 and names.frames:
            f = rng.choice(names.frames)
            return [f"{f}.{rng.choice('XYZABC')}={self.real()}", *[f"LIN {f}"] * (rng.random() < 0.4)]
        if kind < 0.81 and names.frames:
            return [f"{rng.choice(names.frames)}={self.aggregate(self.keys())}"]
        if kind < 0.85 and names.bools:
            return [f"{rng.choice(names.bools)}={self.condition()}"]
        if kind < 0.9:
            return [f"list[{rng.randint(1, 3)}]={self.frame_value()}"]
        if kind < 0.94:
            return [f"list[{rng.randint(1, 3)}].{rng.choice('XYZ')}={self.real()}"]
        if kind < 0.97:
            return [f"job.P.X={self.real()}"]
        return [f"IF {self.condition()} THEN", f"{rng.choice(names.ints or ['mi'])}={self.whole()}", "ENDIF"]

    def state(self) -> list[str]:
        rng = self.rng
        speed = rng.choice(["0.5", "0.05", "1", "0.125"])
        states = [
            f"$VEL.CP={speed}",
            f"BAS(#VEL_CP,{speed})",
            f"$VEL={{CP {speed},ORI1 200,ORI2 200}}",
            f"$VEL.ORI1={rng.randint(50, 200)}",
            f"$APO.CDIS={rng.randint(1, 9)}",
            "$ORI_TYPE=#VAR",
            "$ORI_TYPE=#JOINT",
            rng.choice(["$ORI_TYPE=#CONSTANT", "$ORI_TYPE=#VAR"]),
            rng.choice(["$OV_PRO=50", "$OV_PRO=100", "$OV_PRO=mi"]),
        ]
        return [rng.choice(states)]

    def form(self) -> list[str]:
        rng = self.rng
        n, point = rng.randint(1, 2), rng.choice(["XP1", "XP2", "XP3"])
        if rng.random() < 0.5:
            inner = [f"LDAT_ACT=LCPDAT{n}", f"FDAT_ACT=FP{n}", f"BAS(#CP_PARAMS,{rng.choice(['0.5', '2'])})",
                     f"LIN {point}{rng.choice(['', ' C_DIS', ' C_DIS C_DIS'])}"]  # fmt: skip
        elif rng.random() < 0.3:
            return [
                f"FDAT_ACT=FP{n}",
                f"FDAT_ACT.{rng.choice(['BASE_NO', 'TOOL_NO'])}={rng.randint(1, 4)}",
                "BAS(#FRAMES)",
            ]
        else:
            inner = [f"PDAT_ACT=PPDAT{n}", f"FDAT_ACT=FP{n}", "BAS(#PTP_PARAMS,100)", f"PTP {point}"]
        changes = [
            f"FP{n}.{rng.choice(['BASE_NO', 'TOOL_NO'])}={rng.randint(1, 4)}",
            f"LCPDAT{n}.{rng.choice(['VEL', 'APO_DIST'])}={rng.randint(1, 3)}",
            f"FP{n}=FP{3 - n}",
        ]
        before = [rng.choice(changes)] if rng.random() < 0.1 else []
        return [*before, f";FOLD {inner[-1]} Vel=1 m/s", "$BWDSTART=FALSE", *inner, ";ENDFOLD"]

    def idle(self) -> list[str]:
        n = self.rng.choice(INPUTS)
        idle = self.rng.choice(
            [";note", "HALT", "WAIT SEC 0.5", f"$OUT[{n}]=TRUE", f"WAIT FOR $IN[{n}]", ";LIN {X 9}", ""]
        )
        return ["CONTINUE", idle] if self.rng.random() < 0.2 else [idle]

    def probe(self) -> list[str]:
        """A motion that shows what the flow before has left."""
        rng, names = self.rng, self.names
        plain = self.aggregate("ABC", plain=True)[1:]
        kind = rng.random()
        if kind < 0.35:
            return [f"LIN {self.aggregate(plain=True)}{rng.choice(['', ' C_DIS'])}"]
        if kind < 0.7 and names.ints and names.reals:
            return [
                f"LIN {{X {rng.choice(names.ints)},Y {rng.choice(names.reals)},Z {rng.choice(names.ints)},{plain}"
            ]
        if kind < 0.85 and names.frames:
            return [f"LIN {rng.choice(names.frames)}"]
        return [f"LIN {self.aggregate(rng.choice(['X', 'XY', 'Z', 'YZ']), plain=True)}"]

    def block(self, depth: int, size: int) -> list[str]:
        out: list[str] = []
        while size > 0:
            size -= 1
            if self.has_further and self.rng.random() < 0.25:
                out += self.further(depth)
                continue
            kind = self.rng.random()
            if kind < 0.3:
                out += self.motion()
            elif kind < 0.38:
                out += self.frame()
            elif kind < 0.5:
                out += self.assignment()
            elif kind < 0.54:
                out += self.state()
            elif kind < 0.57:
                out += self.form()
            elif kind < 0.58:
                out += self.idle()
            elif kind < 0.66:
                out += self.call()
            elif kind < 0.68:
                out += self.spline()
            elif kind < 0.76 and self.has_later:
                out += self.later()
            elif self.calm:
                out += self.probe()
            elif depth < 3:
                size -= 1
                out += self.rng.choice(
                    [self.branch, self.branch, self.switch, self.counted, self.loop, self.jump]
                )(depth)
                if self.rng.random() < 0.7:
                    out += self.probe()
        return out

    def inner(self, depth: int) -> list[str]:
        out = self.block(depth + 1, self.rng.randint(1, 4))
        if self.rng.random() < 0.5:
            out += self.rng.choice([self.assignment, self.assignment, self.frame, self.state])()
        return out

    def branch(self, depth: int) -> list[str]:
        out = [f"IF {self.condition()} THEN", *self.inner(depth)]
        if self.rng.random() < 0.1 and self.routine:
            out.append("RETURN")
        if self.rng.random() < 0.5:
            out += ["ELSE", *self.inner(depth)]
        return [*out, "ENDIF"]

    def switch(self, depth: int) -> list[str]:
        rng, names = self.rng, self.names
        out = []
        chosen = rng.choice(names.ints) if names.ints else "3"
        if names.ints and self.inputs and rng.random() < 0.4:
            out += [
                f"{chosen}=1",
                f"IF {self.condition(True)} THEN",
                f"{chosen}={rng.randint(2, 3)}",
                "ENDIF",
            ]
        out.append(f"SWITCH {chosen if rng.random() < 0.8 else self.whole()}")
        for case in rng.sample(["1", "2,3", "3", "4,5", "0"], rng.randint(1, 3)):
            out += [f"CASE {case}", *self.inner(depth)]
        if rng.random() < 0.5:
            out += ["DEFAULT", *self.inner(depth)]
        return [*out, "ENDSWITCH"]

    def counted(self, depth: int) -> list[str]:
        rng, names = self.rng, self.names
        if not names.free:
            return self.motion()
        counter = names.free.pop()
        first, last, step = rng.choice(
            [(1, "3", ""), (1, "2", ""), (3, "1", " STEP -1"), (1, "7", " STEP 2"), (2, "1", "")]
        )
        before = []
        if names.ints and rng.random() < 0.3:
            bound = rng.choice(names.ints)
            before = [f"{bound}=2"]
            if self.inputs and rng.random() < 0.5:
                before += [f"IF {self.condition(True)} THEN", f"{bound}=3", "ENDIF"]
            # the bound is read once; what the loop does to it is left alone
            names.ints.remove(bound)
            last, first, step = bound, 1, ""
        names.counters.append(counter)
        body = self.inner(depth)
        if rng.random() < 0.15:
            body += [f"IF {self.condition()} THEN", "EXIT", "ENDIF", *self.motion()]
        names.counters.remove(counter)
        if rng.random() < 0.2:
            ahead = f"{counter}={counter}{'-' if step.endswith('-1') else '+'}1"
            body[:0] = [ahead] if rng.random() < 0.5 else [f"IF {self.condition()} THEN", ahead, "ENDIF"]
        if before:
            names.ints.append(before[0].partition("=")[0])
        names.free.append(counter)
        return [*before, f"FOR {counter}={first} TO {last}{step}", *body, "ENDFOR"]

    def loop(self, depth: int) -> list[str]:
        rng, names = self.rng, self.names
        if not names.free:
            return self.motion()
        counter = names.free.pop()
        limit = rng.randint(1, 3)
        names.counters.append(counter)
        body = self.inner(depth)
        names.counters.remove(counter)
        names.free.append(counter)
        count = f"{counter}={counter}+1"
        ends = self.condition(True) if self.inputs and rng.random() < 0.4 else f"{counter}>{limit}"
        kind = rng.random()
        if kind < 0.35:
            goes = ends if ends.startswith("$") else f"{counter}<={limit}"
            return [f"{counter}=1", f"WHILE {goes}", *body, count, "ENDWHILE"]
        if kind < 0.65:
            return [f"{counter}=1", "REPEAT", *body, count, f"UNTIL {ends}"]
        leave = [f"IF {ends} THEN", "EXIT", "ENDIF"]
        rest = self.motion() if rng.random() < 0.5 else []
        return [f"{counter}=1", "LOOP", *body, count, *leave, *rest, "ENDLOOP"]

    def jump(self, depth: int) -> list[str]:
        self.labels += 1
        label, names, rng = f"lab{self.labels}", self.names, self.rng
        if rng.random() < 0.3:
            away = [f"IF {self.condition()} THEN", *self.assignment(), f"GOTO {label}", "ENDIF"]
            body = rng.choice([self.counted, self.loop, self.branch])(depth)
            at = next(
                (
                    n
                    for n, line in enumerate(body)
                    if line.startswith(("FOR", "WHILE", "LOOP", "REPEAT", "IF"))
                ),
                None,
            )
            if at is not None:
                return [*body[: at + 1], *away, *body[at + 1 :], *self.motion(), f"{label}:"]
        if rng.random() < 0.65 or not names.free:
            go = (
                [f"IF {self.condition()} THEN", f"GOTO {label}", "ENDIF"]
                if rng.random() < 0.85
                else [f"GOTO {label}"]
            )
            return [*go, *self.inner(depth), f"{label}:"]
        counter = names.free.pop()
        names.counters.append(counter)
        body = self.inner(depth)
        names.counters.remove(counter)
        names.free.append(counter)
        again = self.condition(True) if self.inputs and rng.random() < 0.4 else f"{counter}<3"
        return [
            f"{counter}=1",
            f"{label}:",
            *body,
            f"{counter}={counter}+1",
            f"IF {again} THEN",
            f"GOTO {label}",
            "ENDIF",
        ]

    def call(self) -> list[str]:
        later = range(self.routine + 1, self.subprograms + 1)
        if not later or not self.names.ints or not self.names.reals:
            return self.motion()
        number = self.rng.choice(later)
        given = [self.whole(), self.returned()]
        if way := self.takes_frame[number - 1]:
            places = [*self.names.frames, *self.names.frames, "list[2]", "job.P", "$BASE", "BASE_DATA[2]"]
            given.append(self.frame_value() if way == "IN" else self.rng.choice(places))
        seen = given[1].startswith(("$", "s[")) or "." in given[1]
        plain = self.aggregate("YZABC", plain=True)[1:]
        shows = [f"LIN {{X {given[1]},{plain}"] if seen and self.rng.random() < 0.7 else []
        return [f"sub{number}({','.join(given)})", *shows]

    def returned(self) -> str:
        """A REAL that a call may change."""
        rng, names = self.rng, self.names
        if rng.random() < 0.7 or not names.frames:
            return rng.choice(names.reals)
        places = [
            f"{rng.choice(names.frames)}.X",
            f"s[({self.whole()} B_AND 1)+1]",
            "list[1].Y",
            "$VEL.CP",
            "$BASE.Z",
        ]
        return rng.choice(places)

    def spline(self) -> list[str]:
        rng = self.rng
        inner = [f"{rng.choice(['SPL', 'SPL', 'SLIN'])} {self.target()}" for _ in range(rng.randint(1, 4))]
        return ["SPLINE", *inner, "ENDSPLINE", *self.probe()]

    # routines

    def locals(self, more: bool) -> list[str]:
        """Declarations of a routine, and what gives its variables their first values; not ``more``: some variables of
        the .dat are hidden by local ones."""
        rng = self.rng
        names = self.names = Names(["n", "m"], ["r", "q"], ["f", "g"], ["b"], [], ["i", "j", "k"])
        hidden: list[str] = []
        if self.module:
            names.frames += MODULE_FRAMES
            names.ints += MODULE_INTS
            names.reals += MODULE_REALS
            if not more:
                hidden = ["mi=2", "mj=3", f"pf={self.aggregate(plain=True)}"]
        out = ["DECL INT mi,mj", "DECL FRAME pf"] if hidden else []
        names.elements = rng.random() < 0.3
        names.free[2] = "kk"
        out += [
            "DECL INT n,m,i,j,kk,k[3]",
            "DECL REAL r,q,s[3]",
            f"DECL {self.frame_type} f,g",
            "DECL BOOL b",
        ]
        first = [f"{name}={rng.randint(0, 6)}" for name in ("n", "m")]
        first += [f"{name}={self.number(0, 50)}" for name in ("r", "q")]
        first += [f"{name}={self.aggregate(plain=True)}" for name in ("f", "g")]
        first.append(f"b={rng.choice(['TRUE', 'FALSE'])}")
        first += [f"{name}[{n}]={rng.randint(0, 9)}" for name in ("k", "s") for n in (1, 2, 3)]
        if names.elements:
            names.ints.append("k[1]")
            names.reals.append("s[2]")
        first += hidden
        if self.has_further:
            declared, given = self.further_locals()
            out, first = out + declared, first + given
        rng.shuffle(first)
        return out + first

    def main(self) -> None:
        rng = self.rng
        self.lines += ["DEF part()", *self.locals(True)]
        if rng.random() < 0.9:
            self.lines += rng.choice(
                [
                    ["BAS(#INITMOV,0)"],
                    ["BAS(#BASE,1)", "BAS(#TOOL,1)"],
                    ["$TOOL=TOOL_DATA[2]", "$BASE=BASE_DATA[1]"],
                ]
            )
        if rng.random() < 0.8:
            self.lines += rng.choice(
                [["PTP {A1 0,A2 -90,A3 90,A4 0,A5 45,A6 0}"], [f"PTP {self.aggregate(plain=True)}"]]
            )
        self.lines += self.block(0, rng.randint(4, 14))
        if self.calm and self.event_routines and self.subprograms and rng.random() < 0.7:
            self.lines += self.interrupted_call()
        self.lines.append("END")

    def subprogram(self, number: int) -> None:
        rng = self.rng
        self.routine = number
        way = rng.choice([":OUT", ""])
        frame = self.takes_frame[number - 1]
        self.lines += [f"DEF sub{number}(v:IN,w{way}{',p:' + frame if frame else ''})"]
        own = self.locals(rng.random() < 0.8)
        self.names.ints.append("v")
        self.names.reals.append("w")
        if frame:
            own = ["FRAME p", *own]
            self.names.frames.append("p")
        self.lines += [
            "INT v",
            "DECL REAL w",
            *own,
            *self.changes(),
            *self.block(1, rng.randint(1, 5)),
            *[*self.frame(), *self.probe(), *self.probe(), *self.frame()]
            * (self.calm and rng.random() < 0.7),
            "END",
        ]

    def changes(self) -> list[str]:
        """What a subprogram does to its parameters."""
        out = [f"v={self.whole()}"] * (self.rng.random() < 0.3) + [f"w={self.real()}"] * (
            self.rng.random() < 0.5
        )
        if "p" in self.names.frames and self.rng.random() < 0.6:
            out.append(f"p.{self.rng.choice('XYZ')}={self.real()}")
        if self.rng.random() < 0.2:
            out += [f"IF v>{self.rng.randint(0, 5)} THEN", "RETURN", "ENDIF"]
        return out


def with_forces(lines: list[str], rng: random.Random) -> list[str]:
    """The program with FORCE comments between its statements and behind them, if it gets some."""
    if rng.random() < 0.5:
        return lines
    share, out = rng.choice([0.02, 0.06, 0.2]), [""]
    for line, following in pairwise([*lines, "END"]):
        inside = not line.startswith("&")
        text = rng.choice([f";FORCE {rng.randint(1, 3)} 0 0", ";FORCE OFF"])
        bare = line and not line.startswith(";")
        if inside and bare and rng.random() < share:
            line += " " + text
        out.append(line)
        outside = line in ("END", "ENDFCT") or following.startswith(("DEF ", "DEFFCT", "GLOBAL DEF"))
        if inside and not outside and not line.startswith("SWITCH ") and rng.random() < share:
            out.append(text)
    return out[1:]
