"""PAYLOAD[n]: which of the controller's payload schedules holds, whose numbers no program has."""

from __future__ import annotations

import re

from postproc.base.document import Document
from postproc.toolpath.stated_loads import StatedLoad

_SET = re.compile(rb"^[ \t]*+\d*+[ \t]*+:[ \t]*+(PAYLOAD[ \t]*+\[[^;\r\n]*+)", re.I | re.M)


def payload_schedules(document: Document) -> tuple[StatedLoad, ...]:
    """The schedules that a program chooses, in the order of the text; none where it is always the same: that is the
    one for which the cell states the mass."""
    found = [
        StatedLoad(document.place(said.start(1))[0], said[1].decode("latin-1").strip()[:60], None)
        for said in _SET.finditer(document.raw)
    ]
    texts = {re.sub(r"[ \t]|(?<!GP\d):[^\]]*", "", one.text.upper()) for one in found}
    return tuple(found) if len(texts) > 1 or any("R[" in text for text in texts) else ()
