"""Random RAPID programs: motions to all kinds of points, in all kinds of flow."""

from __future__ import annotations

EXTRA = "[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]"
TOOLS = ("t1", "t2")
OBJECTS = ("", "\\WObj:=w1", "\\WObj:=w2", "\\WObj:=wobj0")
QUATERNIONS = ("[0,0,1,0]", "[1,0,0,0]", "[0.5,0.5,-0.5,0.5]", "[0.70710678,0,0.70710678,0]")


class Writer:
    """One program from one generator of random numbers."""

    def __init__(self, random) -> None:
        self.random = random
        self.lines: list[str] = []
        self.labels = 0
        self.inside = 0

    def pick(self, *choices):
        return choices[self.random.integers(len(choices))]

    def number(self) -> str:
        return self.pick("0", "1", "-3", "12.5", "250", "-0.125", "1E1", "7.")

    def target(self) -> str:
        return f"[[{self.number()},{self.number()},{self.number()}],{self.pick(*QUATERNIONS)},{EXTRA}]"

    def program(self) -> str:
        self.lines = [
            "MODULE part",
            "PERS tooldata t1:=[TRUE,[[0,0,200],[1,0,0,0]],[5,[0,0,80],[1,0,0,0],0,0,0]];",
            "PERS tooldata t2:=[TRUE,[[10,-5,150.5],[0.70710678,0,0.70710678,0]],[5,[0,0,80],[1,0,0,0],0,0,0]];",
            'PERS wobjdata w1:=[FALSE,TRUE,"",[[1000,0,500],[1,0,0,0]],[[0,10,20],[1,0,0,0]]];',
            'PERS wobjdata w2:=[FALSE,TRUE,"",[[900,50,0],[0.5,0.5,-0.5,0.5]],[[5,10,20],[0.7071068,0,0,0.7071068]]];',
            f"CONST robtarget p1:={self.target()};",
            f"PERS robtarget p2:={self.target()};",
            f"VAR robtarget p3:={self.target()};",
            f"CONST robtarget pa{{3}}:=[{self.target()},{self.target()},{self.target()}];",
            "VAR num n1:=2;",
            f"VAR num n2:={self.number()};",
            "CONST speeddata vm:=[33,500,5000,1000];",
            "CONST zonedata zm:=[FALSE,4,6,6,0.6,6,0.6];",
        ]
        if self.random.random() < 0.3:
            self.lines.append("! FORCE 9 9 9")
        self.lines.append("PROC main()")
        if self.random.random() < 0.3:
            self.lines.append("VAR num n2:=5;")
        self.block(6, True)
        self.lines.append("ENDPROC")
        self.lines.append("PROC sub1(num h,INOUT num o)")
        self.block(3, False)
        if self.random.random() < 0.5:
            self.lines.append(self.pick("o:=o+1;", "o:=h;", "h:=h+1;"))
        self.motion(("h", "o"))
        self.lines += ["ENDPROC", "PROC sub2()"]
        self.block(3, False)
        self.lines += ["ENDPROC", "ENDMODULE"]
        return "\n".join(self.lines) + "\n"

    def value(self, names=()) -> str:
        one = self.pick("n1", "n2", "p3.trans.x", "3", "0.5", *names)
        return self.pick(one, one, f"{one}+1", f"(2*{one}-1)", f"-{one}")

    def condition(self) -> str:
        one = self.pick("di1=1", "di2=0", "n1>1", "n2<=5", "n1=2", "n1+n2<>3")
        return self.pick(one, one, f"NOT ({one})", f"{one} AND di3=1", f"{one} OR n1>7")

    def motion(self, names=()) -> None:
        kind = self.random.integers(10)
        point = (
            self.target() if kind < 3
            else self.pick("p1", "p2", "p3", "pa{1}", "pa{3}", "pa{n1}") if kind < 6
            else f"Offs({self.pick('p1', 'p2', 'p3')},{self.value(names)},0,{self.number()})" if kind < 8
            else f"[[{self.value(names)},2,{self.value(names)}],[0,0,1,0],{EXTRA}]" if kind < 9
            else f"RelTool({self.pick('p1', 'pa{2}')},1,{self.value(names)},-5\\Rx:=10\\Rz:={self.number()})"
        )  # fmt: skip
        word = self.pick("MoveL", "MoveL", "MoveL", "MoveJ", "MoveC", "MoveLDO")
        via = f"{self.target()}," if word == "MoveC" else ""
        speed = self.pick("v50", "v1000", "vm", "[20,500,5000,1000]", "v50\\V:=12")
        zone = self.pick("fine", "z0", "z10", "zm", "z10\\Z:=2", "[TRUE,0,0,0,0,0,0]")
        rest = ",do1,1" if word == "MoveLDO" else ""
        remark = self.pick("", "", "", " ! a remark", " ! FORCE 7 7 7")
        text = f"{word} {via}{point},{speed},{zone},{self.pick(*TOOLS)}{self.pick(*OBJECTS)}{rest};"
        if self.random.random() < 0.1:
            self.lines.append(f"IF {self.condition()} {text}")
        else:
            self.lines.append(text + remark)

    def block(self, most: int, calls: bool, depth: int = 0) -> None:
        for _ in range(int(self.random.integers(1, most + 1))):
            self.statement(calls, depth)

    def statement(self, calls: bool, depth: int) -> None:
        kind = self.random.random()
        if kind < 0.45:
            self.motion()
        elif kind < 0.6:
            self.lines.append(
                self.pick(
                    f"n1:={self.pick('1', '2', '3')};",
                    f"n2:={self.value()};",
                    f"p3:={self.target()};",
                    "p3:=p1;",
                    f"p3.trans.z:={self.value()};",
                    "p3:=Offs(p3,1,0,0);",
                    "p3.trans:=[1,2,3];",
                    "Incr n2;",
                    "n1:=n1+1;",
                    "n2:=n1-1;",
                    "SetDO do1,1;",
                    "WaitTime 0.5;",
                    f"p2.trans.x:={self.number()};",
                )
            )
        elif kind < 0.67:
            self.lines.append(self.pick("! FORCE 1 2 3", "! FORCE OFF", "! words", "! FORCE 0 0 5 @tool"))
        elif kind < 0.71:
            self.lines.append(self.pick("PDispSet d1;", "PDispOff;", "PDispOff;"))
        elif kind < 0.77 and calls:
            self.lines.append(self.pick("sub2;", "sub1 3,n2;", f"sub1 {self.value()},n1;"))
        elif depth < 3:
            self.compound(calls, depth + 1)

    def compound(self, calls: bool, depth: int) -> None:
        kind = self.random.integers(6)
        if kind < 2:
            self.lines.append(f"IF {self.condition()} THEN")
            self.block(3, calls, depth)
            if self.random.random() < 0.4:
                self.lines.append(f"ELSEIF {self.condition()} THEN")
                self.block(2, calls, depth)
            if self.random.random() < 0.5:
                self.lines.append("ELSE")
                self.block(2, calls, depth)
            self.lines.append("ENDIF")
        elif kind == 2:
            name = self.pick("i", "k")
            bounds = self.pick("1 TO 3", "3 TO 1", "1 TO n1", "2 TO 1 STEP 1", "0 TO 10 STEP 4")
            self.lines.append(f"FOR {name} FROM {bounds} DO")
            self.block(3, calls, depth)
            if self.random.random() < 0.5:
                self.motion((name,))
            self.lines.append("ENDFOR")
        elif kind == 3:
            self.lines.append(f"WHILE {self.pick('di1=1', 'di2=1 AND n1<4', 'n1<4', 'n2<>2')} DO")
            self.block(3, calls, depth)
            self.lines.append("ENDWHILE")
        elif kind == 4:
            self.lines.append(f"TEST {self.pick('n1', 'di1', 'n1+1')}")
            for number in ("0", "1,2", "3")[: self.random.integers(1, 4)]:
                self.lines.append(f"CASE {number}:")
                self.block(2, calls, depth)
            if self.random.random() < 0.5:
                self.lines.append("DEFAULT:")
                self.block(2, calls, depth)
            self.lines.append("ENDTEST")
        else:
            self.labels += 1
            name = f"l{self.labels}"
            self.lines.append(f"{name}:")
            self.block(2, calls, depth)
            self.lines.append(f"IF di{self.labels}=1 GOTO {name};")
