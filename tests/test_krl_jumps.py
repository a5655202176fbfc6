"""What is known behind the labels of KRL, against all ways that a program can take."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from tiers import examples

from postproc.base.document import Document
from postproc.languages.dialect import Program
from postproc.languages.krl import KrlDialect
from postproc.toolpath import Toolpath

HEAD = ["DEF part()", "BAS(#BASE,1)", "BAS(#TOOL,1)"]
FULL = "LIN {X 1,Y 2,Z 3,A 4,B 5,C 6}"
PLAIN = [
    "GOTO a",
    "GOTO b",
    "GOTO c",
    "a:",
    "b:",
    "c:",
    "BAS(#BASE,1)",
    "BAS(#BASE,2)",
    FULL,
    FULL,
    "sub()",
    "EXIT",
]
SHAPES = [
    ["IF $IN[1] THEN", "ENDIF"], ["IF $IN[1] THEN", "GOTO a", "ENDIF"], ["IF $IN[2] THEN", "GOTO b", "ENDIF"],
    ["IF $IN[1] THEN", "ELSE", "ENDIF"], ["WHILE $IN[3]", "ENDWHILE"], ["SWITCH i", "CASE 1", "CASE 2", "ENDSWITCH"],
    ["LOOP", "ENDLOOP"], ["FOR i=1 TO n", "ENDFOR"],
]  # fmt: skip
CLOSES = {"ENDIF": "IF", "ENDWHILE": "WHILE", "ENDSWITCH": "SWITCH", "ENDLOOP": "LOOP", "ENDFOR": "FOR"}


def read(body: list[str]) -> Program:
    text = "\n".join([*HEAD, *body, "END", "DEF sub()", "BAS(#BASE,2)", "END", ""])
    return KrlDialect().read((Document(Path("part.src"), text.encode()),))


@st.composite
def programs(draw: st.DrawFn, deep: int = 3) -> list[str]:
    """Lines with blocks that pair, and jumps and labels anywhere."""
    body: list[str] = []
    for _ in range(draw(st.integers(0, 5))):
        if deep and draw(st.booleans()):
            first, *rest = draw(st.sampled_from(SHAPES))
            body.append(first)
            for word in rest:
                if first[:6] != "SWITCH" or body[-1] != first:
                    body += draw(programs(deep - 1))
                body.append(word)
        else:
            body.append(draw(st.sampled_from(PLAIN)))
    return body


def blocks(body: list[str]) -> dict[int, list[int]]:
    """Line of each opening, branching and closing word -> the lines of its block's words."""
    found: dict[int, list[int]] = {}
    stack: list[list[int]] = []
    for at, line in enumerate(body):
        word = line.split(" ")[0]
        if word in CLOSES.values():
            stack.append([at])
        elif word in CLOSES or word in ("ELSE", "CASE"):
            stack[-1].append(at)
            if word in CLOSES:
                lines = stack.pop()
                found.update(dict.fromkeys(lines, lines))
    return found


def bases(body: list[str], pairs: dict[int, list[int]]) -> dict[int, set[int]]:
    """Line of a motion -> the bases with which some way arrives there; a condition may hold or not."""
    labels: dict[str, int] = {}
    for at, line in enumerate(body):
        if line.endswith(":"):
            labels.setdefault(line[:-1], at)
    seen: set[tuple[int, int]] = set()
    found: dict[int, set[int]] = {}
    todo = [(0, 1)]
    while todo:
        at, base = todo.pop()
        if at >= len(body) or (at, base) in seen:
            continue
        seen.add((at, base))
        line = body[at]
        word = line.split(" ")[0]
        after = [at + 1]
        if line == FULL:
            found.setdefault(at, set()).add(base)
        elif line.startswith("BAS"):
            base = int(line[-2])
        elif line == "sub()":
            base = 2
        elif word == "GOTO":
            after = [labels[line[5:]]] if line[5:] in labels else []
        elif word == "IF":
            after.append(pairs[at][1] + (body[pairs[at][1]] == "ELSE"))
        elif word == "ELSE":
            after = [pairs[at][-1]]
        elif word == "SWITCH":
            after = [other + 1 for other in pairs[at][1:-1]] + [pairs[at][-1]]
        elif word == "CASE":
            after = [pairs[at][-1]]
        elif word in ("WHILE", "FOR"):
            after.append(pairs[at][-1] + 1)
        elif word in ("ENDWHILE", "ENDLOOP", "ENDFOR"):
            after = [pairs[at][0]] + [at + 1] * (word == "ENDFOR")
        elif word == "EXIT":
            around = [
                p[-1] for b, p in pairs.items() if b == p[0] and p[0] < at < p[-1] and body[b][0] in "WLF"
            ]
            after = [min(around) + 1] if around else [at + 1]
        todo += [(other, base) for other in after]
    return found


def never_runs(path: Toolpath, row: int) -> bool:
    found = path.constraints.refused.get(row)
    return found is not None and found.code == "KRL023"


@pytest.mark.slow
@settings(deadline=None, max_examples=examples(300))
@given(programs())
def test_a_base_that_is_known_is_that_of_every_way(body: list[str]) -> None:
    path, possible = read(body).toolpath, bases(body, blocks(body))
    for at, some in possible.items():
        rows = np.flatnonzero(path.line == at + 1 + len(HEAD))
        assert not all(never_runs(path, row) for row in rows.tolist()), "\n".join(body)
        if (path.base[rows] >= 0).all():
            assert some <= {path.frames[path.base[row]].number for row in rows}, "\n".join(body)


@pytest.mark.parametrize(
    ("body", "kept"),
    [
        (["IF $IN[1] THEN", "GOTO a", "ENDIF", FULL, "a:", FULL], True),
        (["a:", FULL, "IF $IN[1] THEN", "GOTO a", "ENDIF"], True),
        (["BAS(#BASE,2)", "IF $IN[1] THEN", "GOTO a", "ENDIF", FULL, "a:", FULL, "BAS(#BASE,1)"], True),
        (["IF $IN[1] THEN", "GOTO a", "ENDIF", "BAS(#BASE,2)", "a:", FULL], False),
        (["a:", FULL, "sub()", "IF $IN[1] THEN", "GOTO a", "ENDIF"], False),
        (["IF $IN[1] THEN", "BAS(#BASE,2)", "GOTO a", "ELSE", "a:", FULL, "ENDIF"], False),
        (["IF $IN[1] THEN", "BAS(#BASE,2)", "a:", FULL, "ELSE", "GOTO a", "ENDIF"], False),
        (["IF $IN[1] THEN", "a:", "ENDIF", FULL, "IF $IN[2] THEN", "sub()", "GOTO a", "ENDIF"], False),
        (["WHILE $IN[1]", FULL, "a:", "ENDWHILE", "IF $IN[2] THEN", "sub()", "GOTO a", "ENDIF"], False),
        (["a:", FULL, "IF $IN[1] THEN", "GOTO b", "ENDIF", "c:", "IF $IN[2] THEN", "GOTO a", "ENDIF", "GOTO d",
          "b:", "BAS(#BASE,2)", "IF $IN[3] THEN", "GOTO c", "ENDIF", "d:"], False),
    ],
)  # fmt: skip
def test_a_label_forgets_what_changes_on_the_way_to_it(body: list[str], kept: bool) -> None:
    path = read(body).toolpath
    last = len(HEAD) + len(body) - body[::-1].index(FULL)
    assert (path.base[path.line.tolist().index(last)] >= 0) == kept


def test_a_way_out_of_a_loop_that_is_given_up_starts_elsewhere() -> None:
    """Its rows are gone, and what comes from them is not."""
    body = ["GOTO a", "LOOP", "IF $IN[1] THEN", "GOTO a", "LIN {X 1,Y 2,Z 3,A 4,B 5,C 6}", "IF $IN[1] THEN", "GOTO c",
            "EXIT", "ENDIF", "IF $IN[1] THEN", "c:", "sub()", "ENDIF", "ENDIF", "ENDLOOP"]  # fmt: skip
    path = read(body).toolpath
    assert all(row < len(path) for rows in path.predecessors.values() for row in rows)
    assert not path.continues.any()


@pytest.mark.parametrize(
    "block",
    [("IF $IN[1] THEN", "ENDIF"), ("IF $IN[1] THEN", "ELSE", "ENDIF"), ("WHILE $IN[1]", "ENDWHILE"),
     ("FOR i=1 TO n", "ENDFOR"), ("REPEAT", "UNTIL $IN[1]"), ("SWITCH i", "CASE 1", "CASE 2", "ENDSWITCH")],
)  # fmt: skip
def test_what_a_jump_into_a_block_leads_to_may_run(block: tuple[str, ...]) -> None:
    """A controller may refuse the program; where it does not, the motions at the label and behind the block run."""
    *words, last = block
    path = read(["GOTO a", *words, "a:", FULL, last, FULL]).toolpath
    assert not any(never_runs(path, row) for row in range(len(path)))
