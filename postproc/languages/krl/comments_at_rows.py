"""FORCE and COMPENSATE comments at the motions at which they are in force."""

from __future__ import annotations

from itertools import pairwise

from postproc.languages.core.comments_in_force import (
    CONTRADICTED,
    VARYING,
    CommentInForce,
    InForce,
    is_initial,
    place_of,
)
from postproc.languages.krl.motion_rows import MotionRows, RowRefusal
from postproc.toolpath import Annotation

_WORDS = {"force": "FORCE", "switch": "COMPENSATE"}


def take_comments(rows: MotionRows) -> tuple[Annotation, ...]:
    """The comments in the order of motions; one is stated again at a motion to which a path leads that passes others.

    Refused are motions at which the comment in force differs with the path that leads there, or at which none is in
    force behind one in the text.
    """
    found: list[Annotation] = []
    last: dict[str, InForce] = dict.fromkeys(_WORDS)
    passed = iter(rows.annotations)
    following = next(passed, None)
    for row, end in pairwise([*rows.in_force, len(rows)]):
        while following is not None and following.row <= row:
            found.append(following)
            last[place_of(following.text)] = CommentInForce.of(following.text, following.line)
            following = next(passed, None)
        for name, comment in zip(_WORDS, rows.in_force[row], strict=True):
            if comment is VARYING:
                rows.ranges.append((row, end, RowRefusal("KRL036", CONTRADICTED, "comments")))
            elif isinstance(comment, CommentInForce) and comment != last[name]:
                found.append(Annotation(row, comment.text, comment.line))
                last[name] = comment
            elif (
                comment is None
                and isinstance(before := last[name], CommentInForce)
                and not is_initial(before)
            ):
                message = f"no {_WORDS[name]} comment is in force: no path leads here from that in line {before.line}"
                rows.ranges.append((row, end, RowRefusal("KRL036", message, f"no {name}")))
    return (*found, *([] if following is None else [following]), *passed)
