"""Where X, Y, Z are the tool's tip without a TCP code, as the cell states it (``cell_options.ROTARY_WORDS``)."""

from __future__ import annotations

import numpy as np

from postproc.languages.gcode.cell_options import AT_TIP, OTHER_M, SWITCHED, TIP_OFF_M, TIP_ON_M
from postproc.languages.gcode.control import Group
from postproc.languages.gcode.execution_flow import FlowReason
from postproc.languages.gcode.modal import Modal
from postproc.languages.gcode.modal_fill import fill_modal
from postproc.languages.gcode.source import Source
from postproc.languages.gcode.words import key


def with_stated_kinematics(source: Source, modal: Modal, stated: str) -> Modal:
    """``modal`` with what the cell states of the TCP mode; as it is where the program has other codes than are stated,
    or where it is not known whether they run."""
    m = source.column(key("M"))
    switching = np.isin(m.value, (TIP_ON_M, TIP_OFF_M, OTHER_M))
    if stated == AT_TIP and not switching.any():
        return modal.with_value(Group.TCP, 1)
    at, value = m.block[switching], m.value[switching]
    sure = (modal.flow.reason[at] == FlowReason.NONE).all() and not (value == OTHER_M).any()
    if stated != SWITCHED or not sure or not len(at):
        return modal
    kept = modal.flow.tape[at]
    on = (value[kept] == TIP_ON_M).astype(np.int8)
    return modal.with_values(Group.TCP, fill_modal(len(source.blocks), at[kept], on, 0, np.int8), 0)
