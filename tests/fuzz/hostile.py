"""Input that is made to hurt: long, deep, or about itself."""

from __future__ import annotations


def hostile(size: int) -> dict[str, bytes]:
    """Programs of about so many bytes, by what is odd about them."""
    return {
        "nothing": b"",
        "newlines": b"\n" * size,
        "carriage returns": b"\r" * size,
        "blanks": b" " * size,
        "zeros": b"\0" * size,
        "one word": b"A" * size,
        "digits": b"LIN {X " + b"1" * size + b"}",
        "braces": b"LIN " + b"{" * size,
        "brackets": b"G1 X" + b"[" * size,
        "open comments": b"(" * size,
        "strings": b'"' * size,
        "commas": b"LIN {" + b"," * size + b"}",
        "operators": b"LIN P" + b":P" * (size // 2),
        "signs": b"G1 X" + b"-" * size,
        "loops": b"DEF a()\n" + b"LOOP\n" * (size // 5) + b"END\n",
        "counted loops": b"DEF a()\n" + b"FOR I=1 TO 1000000000\n" * (size // 22) + b"LIN {X 1}\nEND\n",
        "nested counted loops": b"DEF a()\n"
        + b"FOR I=1 TO 99\n" * 9
        + b"LIN {X I}\n"
        + b"ENDFOR\n" * 9
        + b"END\n",
        "a loop about itself": b"DEF a()\na()\nEND\n",
        "branches": b"DEF a()\n" + b"IF X THEN\n" * (size // 10) + b"END\n",
        "folds": b";FOLD LIN P1\n" * (size // 13),
        "jumps": b"DEF a()\n" + b"GOTO L\nL:\n" * (size // 10) + b"END\n",
        "calls": b"DEF a()\n"
        + b"b()\n" * (size // 8)
        + b"END\nDEF b()\n"
        + b"a()\n" * (size // 8)
        + b"END\n",
        "assignments": b"DEF a()\n" + b"P=P:P\n" * (size // 6) + b"LIN P\nEND\n",
        "sums": b"DEF a()\nX=" + b"1+" * (size // 2) + b"1\nEND\n",
        "parentheses": b"DEF a()\nX=" + b"(" * (size // 2) + b")" * (size // 2) + b"\nEND\n",
        "repeated words": b"G1" + b" X1" * (size // 3),
        "modal codes": b"G90 G91 " * (size // 8),
        "arcs without a radius": b"G2 X1 Y1 I0 J0\n" * (size // 15),
        "program numbers": b"O1\nM98 P1\n" * (size // 10),
        "names of tools": b'T="' * (size // 3),
        "open increments": b"X=AC(" * (size // 5),
        "lines of open increments": b"X=AC(\n" * (size // 6),
        "labels": b"N1 GOTOB N1\n" * (size // 12),
    }
