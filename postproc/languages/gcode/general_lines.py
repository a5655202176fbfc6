"""Lines that are not plain words: expressions, variables, flow, program numbers, tape marks, text."""

from __future__ import annotations

import math
import re

from postproc.languages.gcode.control import LexedLine
from postproc.languages.gcode.words import How, value_note

_NUMBER = rb"[-+]?[ \t]*(?:\d[\d \t]*(?:\.[\d \t]*)?|\.[ \t]*\d[\d \t]*)"
_TOKEN = re.compile(
    rb"[ \t\x0b\x0c]+"
    rb"|(?P<slash>/[ \t]*[1-9]?(?!\d))"
    rb"|(?P<name>[A-Za-z_][A-Za-z_]+)"
    rb"|(?P<letter>[A-Za-z])[ \t]*+(?:(?P<number>"
    + _NUMBER
    + rb")(?![\d.\[])|(?P<sign>[-+]?[ \t]*)(?P<open>[#\[]"
    rb"|[A-Za-z]{2,5}[ \t]*\[))"
    rb"|(?P<bare>[A-Za-z])(?![A-Za-z_0-9.\[#])"
    rb"|(?P<assign>#)"
    rb"|(?P<corner>,[ \t]*[A-Za-z][ \t]*(?:" + _NUMBER + rb")?)"
    rb"|(?P<check>\*[ \t]*\d+[ \t]*\Z)"
)
_HEAD = re.compile(rb"[ \t]*(?:(?P<tape>%)|(?P<program>:[ \t]*\d+|<[^>]*>))")
_FLOW = re.compile(
    rb"[ \t]*+(?P<slash>/[ \t]*+)?(?:N[ \t]*\d+[ \t]*)?(?P<label>O[ \t]*(?:\d+|<[^>]*>|#[^ \t]*|\[[^\]]*\]))[ \t]*"
    rb"(?P<word>[A-Za-z]+)", re.I
)  # fmt: skip
_TEXT = re.compile(rb"[ \t]*(?:N[ \t]*\d+[ \t]*)?(M[ \t]*11[78])(?!\d)", re.I)
_TARGET = re.compile(rb"#[ \t]*+(\d++|<[^>]*+>|(?=[#\[]))")
_ASSIGNED = re.compile(rb"[ \t]*+=[ \t]*+")
_OPERATOR = re.compile(
    rb"[ \t]*+(?:\*\*|[-+*/]|(?:AND|OR|XOR|MOD|EQ|NE|GT|GE|LT|LE)(?![A-Za-z_]))[ \t]*+", re.I
)
_CONSTANT = re.compile(rb"[-+]?[ \t]*+(?:\d[\d \t]*+(?:\.[\d \t]*+)?|\.[ \t]*+\d[\d \t]*+)")
_THEN = re.compile(rb"[^\]]*+(?:\][^\]]*?)*?\][ \t]*+THEN(?![A-Za-z_])[ \t]*+", re.I)

_FLOW_WORDS = {
    **dict.fromkeys(b"SUB DO IF REPEAT".split(), "open"),
    **dict.fromkeys(b"ENDSUB ENDWHILE ENDIF ENDREPEAT".split(), "close"),
    **dict.fromkeys(b"ELSE ELSEIF BREAK CONTINUE RETURN".split(), "between"),
    b"WHILE": "while",
    b"CALL": "call",
}
"""Words after an O-word; ``while`` opens a loop, or closes the one that ``do`` with its number has opened."""

_JUMPS = frozenset(b"IF GOTO THEN".split())
HARMLESS = (b"EXCLUDE_OBJECT", b"SET_", b"TIMELAPSE", b"POPEN", b"PCLOS", b"DPRNT", b"BPRNT", b"MSG")
"""Names of commands that move nothing."""


def line(text: bytes) -> LexedLine:
    """Takes one line apart, comments blanked."""
    words: list[tuple[int, int, int, int, float, int]] = []
    notes: list[tuple[str, str]] = []

    def note(kind: str, text: bytes) -> None:
        notes.append((kind, text.decode("latin-1")))

    place, deleted = 0, False
    codes: set[int] = set()
    looked_at = 0  # words whose codes are known
    head = _HEAD.match(text)
    if head is not None:
        place = head.end()
        if head["tape"]:
            note("tape", b"%")
            return LexedLine(words, notes, False)
        # With more after it, it is the number of a block.
        if head["program"] and not text[place:].strip():
            note("program", head["program"])
    said = _TEXT.match(text, place)
    if said is not None:
        words.append((said.start(1), ord("M"), -1, said.end(1), 117.0, How.INTEGER))
        return LexedLine(words, notes, deleted)
    flow = _FLOW.match(text, place)
    if flow is not None:
        label, word = flow["label"].upper().translate(None, b" \t"), flow["word"].upper()
        note(
            _FLOW_WORDS.get(word, "unknown"),
            (label + b" " + word + b" " + text[flow.end() :].strip()).strip(),
        )
        return LexedLine(words, notes, flow["slash"] is not None)
    while place < len(text):
        found = _TOKEN.match(text, place)
        if found is None and _speaks(words):
            break
        if found is None:
            note("unknown", text[place:].strip())
            break
        place = found.end()
        kind = found.lastgroup or ""
        if kind == "number":
            literal = found["number"]
            start = found.start("number")
            stop = start + len(literal.rstrip())
            value = float(literal.translate(None, b" \t"))
            how = How.NUMBER if b"." in literal else How.INTEGER
            if not math.isfinite(value):
                value, how = math.nan, How.UNREAD
            words.append((found.start("letter"), ord(found["letter"].upper()), start, stop, value, how))
        elif kind == "open":
            start = found.start("sign")
            place = _expression(text, found.start("open"))
            at = found.start("letter")
            letter = ord(found["letter"].upper())
            note("value", value_note(words, letter, How.NUMBER, text[start:place]))
            words.append((at, letter, start, place, math.nan, How.UNREAD))
        elif kind == "slash":
            deleted = True
        elif kind == "bare":
            # G28 X Y of printers; after an M code (M84 X Y) it is no axis.
            at = found.start("bare")
            codes.update(word[1] for word in words[looked_at:])
            looked_at = len(words)
            if ord("G") in codes:
                words.append((at, ord(found["bare"].upper()), -1, at + 1, math.nan, How.UNREAD))
            elif ord("M") not in codes:
                note("unknown", text[found.start() :].strip())
                break
        elif kind == "assign":
            end = _assignment_end(text, found.start())
            if end is None:
                note("unknown", text[found.start() :].strip())
                break
            note("assign", text[found.start() : end].strip())
            place = end
        elif kind == "corner":
            corner = (
                found["corner"][1:].strip()[:1].upper() in b"CR"
            )  # else an angle (,A) that states the end
            note("corner" if corner else "polar", text[found.start() :].strip())
        elif kind == "name":
            word = found["name"].upper()
            if word.startswith(HARMLESS) or _speaks(words):
                break
            then = _THEN.match(text, found.end()) if word == b"IF" else None
            if (
                then is not None
                and then.end() < len(text)
                and not text[then.end() :].upper().startswith(b"GOTO")
            ):
                deleted, place = True, then.end()  # what follows runs where the condition holds
                note("if", text[found.end() : then.end()].strip()[: -len(b"THEN")])
                continue
            if then is not None and then.end() == len(text):
                note("open", b"IF " + text[found.end() : then.end()].strip()[: -len(b"THEN")])
            elif word in (b"ELSE", b"ENDIF"):
                note("between" if word == b"ELSE" else "close", word)
            elif word in _JUMPS:
                note("jump", text[found.start() :].strip())
            elif word in (b"WHILE", b"DO", b"END"):
                note("close" if word == b"END" else "open", text[found.start() :].strip().upper())
            else:
                note("unknown", text[found.start() :].strip())
            break
    opened = any(text.count(one) > text.count(other) for one, other in ((b"[", b"]"), (b"#<", b">")))
    if words and (opened or text.rstrip().endswith(b"#")):
        # What is put after such a line would belong to its expression.
        note("unknown", text.strip())
    return LexedLine(words, notes, deleted)


def _speaks(words: list[tuple[int, int, int, int, float, int]]) -> bool:
    """Whether a line starts with an M code of a printer: what follows may be any text."""
    codes = [(letter, value) for _, letter, _, _, value, _ in words[:2] if letter != ord("N")]
    return bool(codes) and codes[0][0] == ord("M") and codes[0][1] >= 100


def _assignment_end(text: bytes, at: int) -> int | None:
    """Where ``#target = value`` that starts at ``at`` ends: before the next word of the block.  None: it is none."""
    target = _TARGET.match(text, at)
    if target is None:
        return None
    stop = target.end() if target[1] else _expression(text, at + 1)
    assigned = _ASSIGNED.match(text, stop)
    if assigned is None:
        return None
    place = assigned.end()
    while True:
        number = _CONSTANT.match(text, place)
        if number is not None:
            stop = number.end()
        else:
            stop = _expression(text, place)
            if text[stop - 1 : stop] not in (b"]", b">") and not text[place:stop].lstrip(b"#+- \t").isdigit():
                return None
            if (
                re.fullmatch(rb"[ \t]*+ATAN[ \t]*+\[.*", text[place:stop], re.I | re.S)
                and text[stop : stop + 1] == b"/"
            ):
                place = stop + 1
                continue
        operator = _OPERATOR.match(text, stop)
        if operator is None:
            return stop
        place = operator.end()


def _expression(text: bytes, at: int) -> int:
    """Where an expression that starts at ``at`` ends: a variable, or what its brackets hold."""
    size = len(text)
    while at < size and text[at] in b"#-+ \t":
        at += 1
    if at < size and text[at] in b"<":
        stop = text.find(b">", at)
        return size if stop < 0 else stop + 1
    if at < size and text[at] in b"0123456789":
        while at < size and text[at] in b"0123456789":
            at += 1
        return at
    while at < size and text[at] != 0x5B:
        if not (65 <= text[at] & 0xDF <= 90):
            return at
        at += 1
    depth = 0
    while at < size:
        depth += (text[at] == 0x5B) - (text[at] == 0x5D)
        at += 1
        if depth == 0:
            break
    return at
