"""Lines of Siemens Sinumerik that are not plain words: names, calls, assignments, flow, words with expressions."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping

from postproc.languages.gcode.control import LexedLine
from postproc.languages.gcode.line_words import ADDRESS, LineWords
from postproc.languages.gcode.sinumerik_expression import (
    assigned_end,
    bracket_end,
    constant,
    expression_end,
)
from postproc.languages.gcode.words import NAMES, How, key, value_note

TURN, RPL, RETRACT = NAMES, NAMES + 1, NAMES + 2
"""Keys of TURN=, of RPL=, and of the plane to which a drilling cycle retracts, its first argument."""
NAMED_WORDS: Mapping[bytes, int] = {b"CR": key("R"), b"TURN": TURN, b"RPL": RPL}
"""Addresses of several letters whose numbers say where a motion goes."""

ACTIONS = (b"SPOS", b"SPOSA", b"M", b"H")
CORNERS = frozenset(b"CHR CHF RND".split())
POLAR = frozenset(b"AP RP AR ANG".split())
POSITIONS = frozenset(b"POS POSA POSP MOV AX OS FXS".split())
"""``POS[X]=``: an axis moves by itself, by a computed name, to and fro, or up to a stop."""

CUT: Mapping[bytes, int] = {b"FZ": key("F"), b"SVC": key("S")}
"""Addresses that take the place of F and S."""
SETTINGS = frozenset(
    b"ADIS ADISPOS CTOL OTOL ATOL FGREF FL FA FD FRC FRCM ACC OVRA OVRRAP ACCLIMA JERKLIMA VELOLIMA STAT TU "
    b"TOFFR SF SD SR SRA STA FP FMA DISC DISR DISCL LIMS MEAC PHI PSI DC FXST FXSW FOC".split()
)
"""Addresses that do not state where a motion goes."""

SWITCHES: Mapping[bytes, bytes] = {
    b"TOFF": b"TOFF", b"TOFFL": b"TOFF", b"TOFFLR": b"TOFF", b"DL": b"TOFF", b"TCARR": b"TCARR", b"RNDM": b"RNDM",
    b"OVR": b"OVR",
}  # fmt: skip
"""Addresses that hold on, and are off at 0 (OVR at 100) -> the name of the two states."""

DRILLING = frozenset(f"CYCLE{number}".encode() for number in range(81, 90))
"""Cycles that end in their retraction plane, above where they start."""
MILLING = frozenset(
    b"CYCLE60 CYCLE61 CYCLE62 CYCLE63 CYCLE64 CYCLE70 CYCLE71 CYCLE72 CYCLE73 CYCLE74 CYCLE75 CYCLE76 CYCLE77 CYCLE79 "
    b"CYCLE90 CYCLE801 CYCLE802 CYCLE830 CYCLE840 CYCLE899 HOLES1 HOLES2 POCKET1 POCKET2 POCKET3 POCKET4 SLOT1 SLOT2 "
    b"LONGHOLE".split()
)
"""Cycles that end elsewhere; as all of the control's cycles they bring back the modes in force before them."""

QUIET_CALLS = frozenset(
    b"MSG CYCLE832 SETMS SETAL BRISKA SOFTA DRIVEA JERKA WORKPIECE GROUP_BEGIN GROUP_END GROUP_ADDEND WAITM "
    b"WAITMC WAITE WAITS WAITP INIT START CLEARM SETM CLEAR DISPLOF DISPLON SETINT DISABLE ENABLE CLRINT FPO FENDNORM "
    b"SPCON SPCOF WRITE DELETE STRINGIS PROTD IPTRLOCK IPTRUNLOCK STOPRE CTOL FCTDEF "
    b"RELEASE GET GETD AXTOCHAN CYCLE_HSC EXTERN MMC COUPDEF TANGDEF".split()
)
"""Calls after which the program goes on where it was."""

OPENS = frozenset(b"FOR WHILE LOOP IF".split())
CLOSES = frozenset(b"ENDFOR ENDWHILE ENDLOOP ENDIF UNTIL".split())
JUMPS = frozenset(b"GOTO GOTOF GOTOB GOTOC GOTOS REPEAT REPEATB CASE CALL PCALL EXTCALL CALLPATH".split())
DECLARES = frozenset(b"DEF EXTERN REDEF PROC ID IDS DO WHEN WHENEVER FROM EVERY DEFINE STRING".split())
SUPERIMPOSED = re.compile(rb"\$AA_T?OFF|\b(?:POS|MOV)\[|\b(?:DELDTG|FTOC|PUTFTOC|PUTFTOCF|CORROF|SYNFCT)\b")
"""What a synchronous action does to axes while the program's own motions run: it moves, shifts or stops them."""
OVERRIDDEN = re.compile(rb"\$AC_OVR|\$AC_VC|\$AA_OVR|\$AA_VC|\$A[AC]_PLC_OVR")
QUIET_NAMES = frozenset(b"ELSE DEFAULT SAVE DISPLOF DISPLON SBLOF SBLON ACTBLOCNO ENDLABEL PREPRO".split())

_HEAD = re.compile(
    rb"[ \t\x0b\x0c]*(?P<slash>/[ \t]*\d?[ \t]*)?(?:(?:(?P<letter>[Nn])|:)[ \t]*(?P<number>\d+)[ \t]*)?"
    rb"(?P<slash2>/[ \t]*\d?)?[ \t]*"
)
_LABEL = re.compile(rb"([A-Za-z_][A-Za-z0-9_]+)[ \t]*:(?!=)")
_NAME = re.compile(rb"[A-Za-z_$][A-Za-z_$][A-Za-z0-9_$]*")
_ASSIGNED = re.compile(rb"[ \t]*=(?!=)[ \t]*")
_INDEX = re.compile(rb"[ \t]*\[")
_PROGRAM = re.compile(rb"[ \t]*%[ \t]*([A-Za-z0-9_]*)")
_HOWS = {
    b"AC": How.ABSOLUTE,
    b"DC": How.ABSOLUTE,
    b"ACP": How.ABSOLUTE,
    b"ACN": How.ABSOLUTE,
    b"IC": How.INCREMENTAL,
}
_HOW = re.compile(rb"(ACP|ACN|AC|DC|IC)[ \t]*\(", re.I)
_AXIS = re.compile(rb"(?:JT|ST|RA|TX|TY|TZ|AX|MA)\d+")
_STRING = re.compile(rb'"[^"]*"?')


class SinumerikLines:
    """Takes lines apart.  names: what is alone -> the numbers of its codes; tools: a tool's name -> number."""

    def __init__(self, names: Mapping[bytes, tuple[float, ...]], tools: Mapping[bytes, int]) -> None:
        self._names, self._tools = names, tools

    def __call__(self, text: bytes) -> LexedLine:
        return _SinumerikLine(text, self._names, self._tools).line()


class _SinumerikLine(LineWords):
    def __init__(
        self, text: bytes, names: Mapping[bytes, tuple[float, ...]], tools: Mapping[bytes, int]
    ) -> None:
        super().__init__(text)
        self.names, self.tools = names, tools

    def line(self) -> LexedLine:
        program = _PROGRAM.match(self.text)
        if program is not None:
            self.note("program" if program[1] else "tape", program[1])
            return LexedLine([], self.notes, False)
        head = _HEAD.match(self.text)
        place = head.end() if head else 0
        deleted = head is not None and bool(head["slash"] or head["slash2"])
        label = _LABEL.match(self.text, place)
        if label is not None:
            self.note("label", label[1].upper())
            place = label.end()
        found = self.lexed(head, place, deleted)
        if head is None or not head["letter"]:
            return found
        # jumps lead to it, whatever the block says
        start, stop = head.span("number")
        number = (head.start("letter"), key("N"), start, stop, float(head["number"]), int(How.INTEGER))
        return found._replace(words=[number, *found.words])

    def codes(self, at: int, stop: int, name: bytes) -> None:
        for number in self.names[name]:
            self.word(at, key("G"), -1, stop, number, How.INTEGER)

    def token(self, place: int) -> int:
        text = self.text
        address = ADDRESS.match(text, place)
        if address is not None:
            letter, index = address[1].upper(), address[2]
            if letter == b"R" and index:
                close = assigned_end(text, address.end())
                self.note("assign", text[place:close].strip())
                return close
            if letter == b"G":
                self.note("axis", address[0])
                return expression_end(text, address.end())
            number = key(letter.decode(), int(index) if index else None)
            return self.value(place, number, address.end())
        index = _INDEX.match(text, place + 1) if text[place : place + 1] in b"Rr" else None
        if index is not None:
            assigned = _ASSIGNED.match(text, bracket_end(text, index.end() - 1))
            if assigned is not None:
                close = assigned_end(text, assigned.end())
                self.note("assign", text[place:close].strip())
                return close
        name = _NAME.match(text, place)
        if name is not None:
            return self.name(name[0].upper(), place, name.end())
        end = self.plain_word(place)
        if end is not None:
            return end
        self.note("unknown", text[place:].strip())
        return len(text)

    def value(self, place: int, address: int, at: int) -> int:
        """The value after an equals sign: a constant expression, AC( ), IC( ) of one, a tool's name, or not read."""
        text = self.text
        if address == key("T"):
            string = _STRING.match(text, at)
            if string is not None and string[0] in self.tools:
                tool = self.tools[string[0]]
                self.note("tool", b"T=%s is tool %d of the cell" % (string[0], tool))
                self.word(place, address, -1, string.end(), float(tool), How.INTEGER)
                return string.end()
        how = _HOW.match(text, at)
        if how is not None:
            close = bracket_end(text, how.end() - 1)
            inside = text[how.end() : close - 1]
            shift = len(inside) - len(inside.lstrip())
            number = constant(inside.strip())
            start, stop = how.end() + shift, how.end() + shift + len(inside.strip())
            kind = _HOWS[how[1].upper()]
            if math.isnan(number):
                self.note("value", value_note(self.words, address, kind, inside))
                kind = How.UNREAD
            self.word(place, address, start, stop, number, kind)
            return close
        return self.expression_word(place, address, at)

    def name(self, name: bytes, place: int, end: int) -> int:
        text = self.text
        index = _INDEX.match(text, end)
        stop = bracket_end(text, index.end() - 1) if index is not None else end
        assigned = _ASSIGNED.match(text, stop)
        if assigned is not None and not name.startswith(b"$"):
            return self.assigned(name, place, assigned.end())
        if name.startswith(b"$"):
            if assigned is None:
                rest = text[place:].strip()
                if name.startswith(b"$P_UIFR"):
                    self.note("base", rest)
                else:
                    self.note("unknown", rest)
                return len(text)
            close = assigned_end(text, assigned.end())
            while text[close : close + 1] == b":":  # frames in a chain
                close = assigned_end(text, close + 1)
            kind = (
                "base"
                if name.startswith(b"$P_UIFR")
                else "tool data"
                if name.startswith(b"$TC_")
                else "assign"
            )
            self.note(kind, text[place:close].strip())
            if name == b"$P_PFRAME":  # what it does is not read, as that of a frame from the machine
                self.codes(place, close, b"ROTS")
            return close
        if name in self.names:
            closed = self.arguments(stop)
            if name != b"GEOAX" or text[end:closed].strip(
                b"() \t"
            ):  # without axes: those of the machine again
                self.codes(place, end, name)
            if name == b"CYCLE800":
                self.note("swivel", text[end:closed].strip())
            if name == b"ORIROTC":  # the tool turns about its axis with the path
                self.note("spin", name)
            return closed
        if name == b"RET":
            closed = self.arguments(end)
            if self.text[end:closed].strip(b"() \t,"):  # it goes on elsewhere, or returns from several levels
                self.note("jump", b"GOTOS")
            else:
                self.word(place, key("M"), -1, end, 17.0, How.INTEGER)
            return closed
        return self.statement(name, place, end)

    def assigned(self, name: bytes, place: int, after: int) -> int:
        """``NAME=`` or ``NAME[..]=``."""
        if name in NAMED_WORDS:
            return self.value(place, NAMED_WORDS[name], after)
        close = expression_end(self.text, after)
        end = len(self.text[:close].rstrip())
        if name in ACTIONS:
            # It acts before the motion, as S and M do.
            self.word(place, key("S"), -1, end, math.nan, How.UNREAD)
        elif name in CUT:  # a feed for each tooth and a cutting speed: how many teeth, the tool's data state
            self.word(place, CUT[name], -1, end, math.nan, How.UNREAD)
        elif name in SWITCHES:
            off = constant(self.text[after:end]) == (100 if name == b"OVR" else 0)
            self.codes(place, end, SWITCHES[name] + (b"(OFF)" if off else b"(ON)"))
        elif name == b"FB":
            self.note("feed", name)
        elif name in (b"ID", b"IDS"):
            return self.statement(name, place, after)
        elif name in CORNERS or name in POLAR:
            self.note("corner" if name in CORNERS else "polar", name)
        elif name == b"THETA":
            self.note("spin", name)
        elif name in SETTINGS:
            pass
        elif name in self.names:  # MEAS=1
            self.codes(place, end, name)
        elif name in POSITIONS or self.words or _AXIS.fullmatch(name):
            # In a block with other words it can only be an axis of the machine.
            self.note("axis", name)
        else:
            close = assigned_end(self.text, after)
            self.note("assign", self.text[place:close].strip())
        return max(close, after + 1)

    def arguments(self, end: int) -> int:
        """After the brackets that follow, if there are any."""
        at = end
        while at < len(self.text) and self.text[at] in b" \t":
            at += 1
        return bracket_end(self.text, at) if self.text[at : at + 1] == b"(" else end

    def retract(self, end: int) -> None:
        """The first argument of a cycle whose name ends at ``end``, as a word."""
        at = end
        while self.text[at : at + 1] in (b" ", b"\t"):
            at += 1
        stop = at + 1 if self.text[at : at + 1] == b"(" else at
        depth = 1
        for place in range(stop, len(self.text)):
            depth += (self.text[place] in b"([") - (self.text[place] in b")]")
            if depth == 0 or (depth == 1 and self.text[place] in b","):
                break
        else:
            return
        literal = self.text[stop:place].strip()
        number = constant(literal)
        if math.isnan(number) and literal:
            self.note("value", value_note(self.words, RETRACT, How.NUMBER, literal))
        how = How.UNREAD if math.isnan(number) else How.INTEGER
        self.word(end, RETRACT, -1, self.arguments(end), number, how)

    def statement(self, name: bytes, place: int, end: int) -> int:
        text = self.text
        if name == b"MCALL":
            # With a cycle after it, every block with a position calls that; alone it ends this.
            called = _NAME.search(text, end)
            drilling = called is not None and called[0].upper() in DRILLING
            if drilling and called is not None and (between := text[end : called.start()].strip()):
                self.note("unknown", between)
            on = b"MCALL(CYCLE)" if drilling else b"MCALL()" if text[end:].strip() else b"MCALL_OFF"
            self.codes(place, len(text.rstrip()), on)
            if drilling and called is not None:
                self.retract(called.end())
                rest = text[self.arguments(called.end()) :].strip()
                if rest:
                    self.note("unknown", rest)
            return len(text)
        if name in OPENS or name in CLOSES or name in JUMPS or name in DECLARES or name in QUIET_NAMES:
            said = text[place:].strip().upper()
            if b"GOTO" in said or name in JUMPS:
                self.note("jump" if b"GOTO" in said or name in (b"REPEAT", b"REPEATB") else "call", said)
            elif name in OPENS or name in CLOSES:
                self.note("open" if name in OPENS else "close", said)
            else:
                self.note("between" if name == b"ELSE" else "assign", said)
                if SUPERIMPOSED.search(said):
                    self.codes(place, len(text), b"ROTS")
                if OVERRIDDEN.search(said):
                    self.codes(place, len(text), b"OVR(ON)")
            return len(text)
        closed = self.arguments(end)
        if name == b"FGROUP":
            grouped = text[end:closed].upper().translate(None, b" \t")
            self.codes(place, closed, b"FGROUP(XYZ)" if grouped in (b"()", b"(X,Y,Z)") else b"FGROUP(OTHER)")
            return closed
        if name in QUIET_CALLS:
            return closed
        if name in DRILLING | MILLING and not self.words and not text[closed:].strip():
            self.note("cycle", name)
            if name in DRILLING:
                self.retract(end)
            return closed
        if self.words or (closed == end and text[end:].strip()):
            self.note("unknown", text[place:].strip())
            return len(text)
        self.note("call", text[place:closed].strip().upper())
        return closed
