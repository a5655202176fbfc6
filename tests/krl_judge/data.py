"""Random .dat and $config.dat: points, records, a structure, a list, variables of the module."""

from __future__ import annotations

from abc import abstractmethod

from .operands import Operands

MODULE_FRAMES, MODULE_INTS, MODULE_REALS = ("pf", "pg"), ("mi", "mj"), ("mr",)


class Data(Operands):
    has_further = False

    @abstractmethod
    def further_data(self) -> list[str]: ...

    def dat(self) -> list[str]:
        rng = self.rng
        out = [
            rng.choice(["DEFDAT part", "DEFDAT part PUBLIC"]),
            "STRUC jobtype FRAME P,INT count,REAL width",
        ]
        for name, type_ in (("XP1", "E6POS"), ("XP2", "POS"), ("XP3", "FRAME")):
            out.append(f"DECL {type_} {name}={self.aggregate(plain=True)}")
        for name in MODULE_FRAMES:
            out.append(f"DECL FRAME {name}={self.aggregate(plain=True)}")
        out += [f"DECL INT {name}={rng.randint(0, 6)}" for name in MODULE_INTS]
        out += [f"DECL REAL {name}={self.number(0, 50)}" for name in MODULE_REALS]
        out.append(f"DECL jobtype job={{P {self.aggregate(plain=True)},count 3,width {rng.randint(0, 9)}}}")
        out += self.further_data() if self.has_further else []
        out += ["DECL FRAME list[3]", *(f"list[{n}]={self.aggregate(plain=True)}" for n in (1, 2, 3))]
        for n in (1, 2):
            numbers = f"TOOL_NO {rng.randint(1, 3)},BASE_NO {rng.randint(0, 3)}"
            distance = f"ACC 100.0,APO_DIST {rng.randint(1, 50)}.0"
            mode = rng.choice(["#CDIS", "#CPTP"])
            out.append(f'DECL FDAT FP{n}={{{numbers},IPO_FRAME #BASE,POINT2[] " "}}')
            out.append(f"DECL LDAT LCPDAT{n}={{VEL 2.0,{distance},APO_FAC 50.0,ORI_TYP #VAR}}")
            out.append(f"DECL PDAT PPDAT{n}={{VEL 100.0,{distance},APO_MODE {mode}}}")
        return [*out, "ENDDAT"]

    def config(self) -> list[str]:
        """Half of them state entries of the tables, some one of them twice."""
        rng = self.rng
        out = ["DEFDAT $CONFIG", f"DECL E6POS XC1={self.aggregate(plain=True)}", "DECL REAL DEF_VEL_CP=2.5"]
        out.append("DECL LOAD LOAD_DATA[16]")
        for n in range(1, 5):
            centre = "CM {X 1.0,Y 2.0,Z 3.0,A 0.0,B 0.0,C 0.0},J {X 0.1,Y 0.1,Z 0.1}"
            out.append(f"LOAD_DATA[{n}]={{M {self.number(1, 9)},{centre}}}")
        if rng.random() < 0.5:
            for table in ("BASE_DATA", "TOOL_DATA"):
                stated = rng.sample(range(1, 9), rng.randint(1, 8))
                out += [f"{table}[{n}]={self.aggregate(plain=True)}" for n in stated]
                out += [f"{table}[{stated[-1]}]={self.aggregate(plain=True)}"] * (rng.random() < 0.1)
        return [*out, "ENDDAT"]
