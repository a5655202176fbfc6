"""Random statements whose effect comes at a time of its own, and the routines that they run.

later     = TRIGGER WHEN DISTANCE|PATH=.. DELAY=.. DO does, probe probe
          | declared, motion, INTERRUPT ON n, probe, INTERRUPT OFF n, probe
          | declared, INTERRUPT ON n, call, INTERRUPT OFF n, probe probe
          | INTERRUPT ON|OFF|ENABLE|DISABLE, with a number or for all
declared  = INTERRUPT DECL n WHEN input DO does; GLOBAL before it, or not; in the program and in subprograms
does      = change | a call of an event routine or of a subprogram, with what a call takes, PRIO=n or PRIO=-1
change    = a frame, a table entry, a load, a variable or a component of one gets a value
event     = DEF ir(v:IN,w) changes block END; BRAKE before it, RESUME after it, behind an IF, or not at all
"""

from __future__ import annotations

from abc import abstractmethod

from .data import Data
from .operands import INPUTS


class Later(Data):
    lines: list[str]
    subprograms: int
    event_routines = 0
    takes_frame: list[str]

    @abstractmethod
    def probe(self) -> list[str]: ...

    @abstractmethod
    def motion(self) -> list[str]: ...

    @abstractmethod
    def call(self) -> list[str]: ...

    @abstractmethod
    def returned(self) -> str: ...

    @abstractmethod
    def locals(self, more: bool) -> list[str]: ...

    @abstractmethod
    def changes(self) -> list[str]: ...

    @abstractmethod
    def block(self, depth: int, size: int) -> list[str]: ...

    def change(self) -> str:
        rng, names = self.rng, self.names
        changes = [
            f"{rng.choice(names.reals)}={self.number(0, 50)}",
            "$BASE=BASE_DATA[2]",
            "$TOOL=TOOL_DATA[3]",
        ]
        changes += [f"{name}={self.aggregate(plain=True)}" for name in names.frames[:2]]
        changes += [f"{name}.X={self.number()}" for name in names.frames[:1]]
        changes += [
            f"BASE_DATA[1].X={self.number()}",
            f"TOOL_DATA[2]={self.aggregate(plain=True)}",
            "$VEL.CP=0.25",
            "BAS(#VEL_CP,0.25)",
            "$OV_PRO=30",
            "BAS(#BASE,3)",
            f"list[1]={self.aggregate(plain=True)}",
        ]
        return rng.choice(changes)

    def does(self, wants_call: bool = False) -> str:
        rng, names = self.rng, self.names
        places = [f"ir{n}" for n in range(1, self.event_routines + 1)]
        later = range(self.routine + 1, self.subprograms + 1)
        if not places or not names.ints or not names.reals or not (wants_call or rng.random() < 0.6):
            return self.change()
        if later and rng.random() < 0.25:
            number = rng.choice(later)
            given = [self.whole(), self.returned()]
            if way := self.takes_frame[number - 1]:
                given.append(self.frame_value() if way == "IN" else rng.choice([*names.frames, "list[2]"]))
            called = f"sub{number}({','.join(given)})"
        else:
            called = f"{rng.choice(places)}({self.whole()},{self.returned()})"
        return f"{called} PRIO={rng.choice(['-1', '-1', '5'])}"

    def later(self) -> list[str]:
        rng = self.rng
        kind = rng.random()
        if kind < 0.45:
            where = rng.choice(["DISTANCE=0", "DISTANCE=1", "PATH=-5", f"PATH={self.whole()}"])
            return [
                f"TRIGGER WHEN {where} DELAY={rng.randint(0, 20)} DO {self.does()}",
                *self.probe(),
                *self.probe(),
            ]
        number = rng.choice([rng.randint(1, 30), 7])
        if kind < 0.55:
            return [f"INTERRUPT {rng.choice(['ON', 'OFF', 'ON 7', 'DISABLE', 'ENABLE', 'DISABLE 7'])}"]
        if kind < 0.7:
            return self.interrupted_call()
        return [
            self.declared(number),
            *self.motion(),
            f"INTERRUPT ON {number}",
            *self.probe(),
            *[f"INTERRUPT OFF {number}"] * (rng.random() < 0.7),
            *self.probe(),
        ]

    def declared(self, number: int, calls: bool = False) -> str:
        rng = self.rng
        condition = f"$IN[{rng.choice(INPUTS)}]"
        condition = rng.choice([condition, f"{condition}==TRUE"])
        does = self.does(calls).partition(" PRIO")[0]
        return f"{rng.choice(['', '', 'GLOBAL '])}INTERRUPT DECL {number} WHEN {condition} DO {does}"

    def interrupted_call(self) -> list[str]:
        """A call that an interrupt may end."""
        number = self.rng.randint(1, 30)
        return [
            self.declared(number, True),
            f"INTERRUPT ON {number}",
            *self.call(),
            f"INTERRUPT OFF {number}",
            *self.probe(),
            *self.probe(),
        ]

    def event_routine(self, number: int) -> None:
        rng = self.rng
        self.routine = rng.randint(0, self.subprograms)
        self.lines += [f"DEF ir{number}(v:IN,w{rng.choice([':OUT', ''])})"]
        own = self.locals(rng.random() < 0.8)
        self.names.ints.append("v")
        self.names.reals.append("w")
        body = [*self.changes(), *self.block(2, rng.randint(0, 2))] if rng.random() < 0.5 else []
        ends = rng.choice(
            [[], ["RESUME"], ["RESUME"], ["RESUME"], [f"IF {self.condition()} THEN", "RESUME", "ENDIF"]]
        )
        brake = rng.choice([[], ["BRAKE"], ["BRAKE F"]])
        self.lines += ["INT v", "DECL REAL w", *own, *brake, *body, *ends, "END"]
