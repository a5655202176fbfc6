"""Random RAPID programs with what the first ones do not have: data that programs change, routines with optional
arguments, traps and handlers, routines that motions call, stop points, further modules."""

from __future__ import annotations

from rapid_judge.programs import EXTRA, Writer

TOOL = "[TRUE,[[{},0,{}],[1,0,0,0]],[5,[0,0,80],[1,0,0,0],0,0,0]]"
OBJECT = '[{},{},"{}",[[{},0,500],[1,0,0,0]],[[0,10,20],[1,0,0,0]]]'


class FurtherWriter(Writer):
    """``aside``: what traps, handlers and routines of motions do in this program."""

    def program(self) -> str:
        random = self.random
        self.strays = random.random() < 0.3
        self.lines = [
            "MODULE data(SYSMODULE)",
            f"PERS tooldata t1:={TOOL.format(0, 200)};",
            f"TASK PERS tooldata t2:={TOOL.format(10, 150.5)};",
            f"PERS tooldata t3:={TOOL.format(3, 99)};",
            f"PERS wobjdata w1:={OBJECT.format('FALSE', 'TRUE', '', 1000)};",
            f"LOCAL PERS wobjdata w2:={OBJECT.format('FALSE', 'TRUE', '', 900)};",
            f"PERS wobjdata w3:={OBJECT.format('FALSE', 'TRUE', '', 700)};",
            f"PERS wobjdata w4:={OBJECT.format('FALSE', 'FALSE', 'STN1', 700)};",
            f"PERS wobjdata w5:={OBJECT.format('TRUE', 'TRUE', '', 700)};",
            f"CONST robtarget p1:={self.target()};",
            f"PERS robtarget p2:={self.target()};",
            "VAR num n3:=4;",
            "ENDMODULE",
            "MODULE part",
            "RECORD mark",
            "robtarget at;",
            "num up;",
            "ENDRECORD",
            f"VAR mark m1:=[{self.target()},3];",
            f"VAR mark ma{{2}}:=[[{self.target()},1],[{self.target()},2]];",
            f"LOCAL VAR robtarget p3:={self.target()};",
            f"CONST robtarget pa{{3}}:=[{self.target()},{self.target()},{self.target()}];",
            f"VAR robtarget pv{{2}}:=[{self.target()},{self.target()}];",
            f"CONST jointtarget j1:=[[1,2,3,4,5,6],{EXTRA.partition('],')[2]}];",
            "VAR num n1:=2;",
            f"VAR num n2:={self.number()};",
            "CONST speeddata vm:=[33,500,5000,1000];",
            "CONST zonedata zm:=[FALSE,4,6,6,0.6,6,0.6];",
            "LOCAL PROC main()",
        ]
        if random.random() < 0.3:
            self.lines.append("VAR num n2:=5;")
        if random.random() < 0.5:
            self.lines.append("ISignalDI di9,1,int1;")
        self.block(6, True)
        self.handlers()
        self.lines.append("ENDPROC")
        self.lines.append("PROC sub1(num h,INOUT num o)")
        self.block(3, False)
        self.lines.append(self.pick("o:=o+1;", "o:=h;", "h:=h+1;"))
        self.motion(("h", "o"))
        self.handlers()
        self.lines += ["ENDPROC", "LOCAL PROC sub2()"]
        self.block(3, False)
        self.lines += ["ENDPROC", "PROC sub3(num a,\\num b\\switch s)"]
        self.lines.append(
            self.pick("n2:=a;", "IF Present(s) n1:=1;", "a:=a+1;", "IF a>0 sub3 a-1;", "IF a>0 sub3 a-1;")
        )
        self.motion(("a",))
        self.lines.append("IF Present(b) THEN")
        self.motion(("b", "a"))
        self.lines += [
            "ENDIF",
            "ENDPROC",
            "PROC sync1()",
            self.pick("n3:=7;", "SetDO do3,1;", "w3.uframe.trans.x:=5;"),
        ]
        self.lines.append("ENDPROC")
        self.lines += ["FUNC num f1(num a)", self.pick("n3:=n3+1;", "n2:=a;", "n1:=3;")]
        if random.random() < 0.3:
            self.lines.append("sub2;")
        self.lines += ["RETURN a+1;", "ENDFUNC"]
        if random.random() < 0.5:
            self.lines += ["TRAP tr1", *self.aside(), "ENDTRAP"]
        self.lines.append("ENDMODULE")
        return "\n".join(self.lines) + "\n"

    def aside(self) -> list[str]:
        """What a trap or a handler does."""
        found = [
            self.pick(
                "n3:=n3+1;",
                "SetDO do3,1;",
                "p3.trans.z:=9;",
                "VelSet 100,5000;",
                "SingArea\\Off;",
                "ConfL\\On;",
            )
        ]
        if self.strays:
            found.append(self.pick(f"MoveL {self.target()},v50,fine,t1;", "sub2;", "MoveJ p1,v50,fine,t1;"))
        return found

    def handlers(self) -> None:
        if self.random.random() < 0.3:
            self.lines += ["BACKWARD", "n3:=5;", "MoveL p1,v50,fine,t1;"]
        if self.random.random() < 0.5:
            self.lines += ["ERROR", *self.aside(), self.pick("TRYNEXT;", "RETRY;", "RAISE;")]

    def value(self, names=()) -> str:
        return super().value((*names, "n3", "m1.up", "ma{2}.up", "p3.trans.y"))

    def target_word(self, names=()) -> str:
        """A target in one of all forms."""
        one = self.pick("p1", "p2", "p3", "pv{1}", "pv{n1}", "m1.at", "ma{1}.at", "ma{n1}.at", "pa{2}")
        return self.pick(
            one,
            one,
            self.target(),
            f"Offs({one},{self.value(names)},0,{self.number()})",
            f"RelTool({one},1,{self.value(names)},-5\\Rx:=10\\Rz:={self.number()})",
            f"RelTool(Offs({one},1,2,3),0,0,{self.value(names)})",
        )

    def motion(self, names=()) -> None:
        word = self.pick(
            "MoveL", "MoveL", "MoveJ", "MoveC", "MoveC", "TriggL", "ArcL", "MoveLSync", "MoveAbsJ", "MoveExtJ"
        )
        extra = {"TriggL": ",tg1", "ArcL": ",sm1,wd1\\Weave:=wv1"}.get(word, "")
        concurrent = self.pick("", "", "", "\\Conc,")
        if word == "MoveExtJ":
            self.lines.append("MoveExtJ j1,vm,fine;")
            return
        if word == "MoveAbsJ":
            self.lines.append(f"MoveAbsJ {concurrent.lower()}j1\\NoEOffs,v50,{self.pick('fine', 'z10')},t1;")
            return
        point = self.target_word(names)
        via = f"{self.target()}," if word == "MoveC" else ""
        speed = self.pick("v50", "v1000", "vm", "v50\\V:=12")
        zone = self.pick(
            "fine",
            "z0",
            "z10",
            "zm",
            "z10\\Z:=2",
            "z10\\Inpos:=inpos50",
            "fine\\Inpos:=stoptime1_0",
            "z1\\Inpos:=fllwtime0_5",
        )
        rest = self.pick(
            "", "", "\\WObj:=w1", "\\WObj:=w2", "\\WObj:=w3", "\\WObj:=w4", "\\WObj:=w5", "\\WObj:=wobj0"
        )
        rest += self.pick("", "", "\\TLoad:=load0")
        if word == "MoveLSync":
            rest += ',"sync1"'
        text = f"{word} {concurrent}{via}{point},{speed}{extra},{zone},{self.pick('t1', 't1', 't2', 't3')}{rest};"
        if self.random.random() < 0.1:
            text = f"IF {self.condition()} {text}"
        self.lines.append(text + self.pick("", "", "", " ! FORCE 7 7 7"))
        if concurrent and self.random.random() < 0.5:
            self.lines.append("WaitTime 1;")

    def statement(self, calls: bool, depth: int) -> None:
        kind = self.random.random()
        if kind < 0.55:
            super().statement(calls, depth)
        elif kind < 0.85:
            self.lines.append(
                self.pick(
                    f"m1.at:={self.target_word()};",
                    f"ma{{{self.pick('1', '2', 'n1')}}}.at:={self.target_word()};",
                    f"ma{{1}}.at.trans:=[1,{self.value()},3];",
                    f"m1.up:={self.value()};",
                    f"pv{{{self.pick('1', '2', 'n1')}}}:={self.target_word()};",
                    f"p3:={self.target_word()};",
                    "p3.rot:=[0.5,0.5,-0.5,0.5];",
                    f"t3.tframe.trans.z:={self.value()};",
                    f"t3:={TOOL.format(4, 120)};",
                    f"w3:={OBJECT.format('FALSE', 'TRUE', '', 800)};",
                    f"w3.uframe.trans.y:={self.number()};",
                    "w3.oframe:=w1.oframe;",
                    "n3:=n3+1;",
                    "n3:=4;",
                    "EOffsSet e1;",
                    "EOffsOff;",
                    "SoftAct 1,20;",
                    "SoftDeact;",
                    "PDispOff;",
                    "PDispOn\\Rot\\ExeP:=p1,p2,t1\\WObj:=w1;",
                    "PDispOff;",
                    "EOffsOn p1;",
                    "VelSet 50,5000;",
                    "VelSet 100,5000;",
                    "SingArea\\Wrist;",
                    "SingArea\\Off;",
                    "WaitTime 1;",
                    "WaitTime\\InPos,0.1;",
                    "WaitDI di7,1\\MaxTime:=1;",
                    "WaitDI di7,1\\MaxTime:=1;",
                    "n2:=f1(n3);",
                    "n3:=f1(2);",
                )
            )
        elif calls:
            self.lines.append(
                self.pick(
                    "sub3 2;",
                    "sub3 2\\b:=5;",
                    f"sub3\\s,{self.value()};",
                    "sub3 n1\\b:=n2\\s;",
                    "sub2;",
                    "sub1 3,n3;",
                    '%"sub"+"2"%;',
                )
            )
        else:
            self.motion()
