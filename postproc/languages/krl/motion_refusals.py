"""Why a motion cannot be corrected, from where it is and the state before it."""

from __future__ import annotations

from postproc.languages.krl.execution_context import ExecutionContext
from postproc.languages.krl.modal_state import ModalState
from postproc.languages.krl.motion_rows import RowRefusal, refusal
from postproc.languages.krl.target import UnknownValue
from postproc.toolpath import ArcFrame, Kind, OrientationMode


def frames_missing(run: ExecutionContext) -> RowRefusal | None:
    state = run.state
    if state.root_set:
        return RowRefusal("KRL005", f"the robot's place in the world is set in line {state.root_set}", "root")
    if state.later_since:
        what = f"the interrupt or trigger of line {state.later_since} may change base or tool at any time"
        return RowRefusal("KRL005", what, "later")
    for frame in (state.base, state.tool):
        if isinstance(frame, UnknownValue):
            return refusal(frame, "", frame.message)
    if state.tool_known:
        return RowRefusal("KRL013", "the tool is fixed in the world ($IPO_MODE=#TCP)", "tcp")
    return None


def orientation_refusal(state: ModalState, kind: Kind) -> RowRefusal | None:
    """Why it is not known how the tool turns on a motion, or not in a way that is corrected."""
    if kind not in (Kind.LIN, Kind.CIRC, Kind.SPL):
        return None
    if state.orientation == OrientationMode.UNKNOWN:
        return RowRefusal(
            "KRL031",
            "the orientation between the points is not known: $ORI_TYPE is none of #VAR, #CONSTANT, #JOINT",
            "ori",
        )
    if state.orientation == OrientationMode.JOINT and kind is not Kind.SPL:
        return RowRefusal(
            "KRL031", "the wrist axes move linearly, and the tool does not ($ORI_TYPE=#JOINT)", "joint"
        )
    if (
        kind is Kind.CIRC
        and state.orientation == OrientationMode.CONSTANT
        and state.arc_frame == ArcFrame.PATH
    ):
        message = "the tool rotates with the executed arc ($ORI_TYPE=#CONSTANT, $CIRC_TYPE=#PATH)"
        return RowRefusal("KRL031", message, "path")
    if kind is Kind.CIRC and state.arc_frame == ArcFrame.UNKNOWN:
        return RowRefusal(
            "KRL031",
            "the orientation on the arc is not known: $CIRC_TYPE or $CIRC_MODE is not understood",
            "circ",
        )
    return None


def structure_refusal(run: ExecutionContext) -> RowRefusal | None:
    """The reason that lies in where the motion is."""
    routine = run.routine
    if run.idle:
        return RowRefusal(
            "KRL023", "the flow that the program's constants define does not lead here", "never"
        )
    if routine is None:
        if run.structure.has_routine:
            return RowRefusal("KRL014", "the motion is outside every DEF", "outside")
    elif run.walked and routine.name in run.structure.later:
        message = f"it is in the subprogram of line {routine.line}, which an interrupt or trigger calls"
        return RowRefusal("KRL015", message, f"def {routine.line}")
    if run.opaque is not None:
        word = run.opaque.word.decode("latin-1")
        what = f"it is inside the {word} block of line {run.opaque.line}, whose structure is not understood"
        return RowRefusal("KRL006", what, f"in {run.opaque.line}")
    return None
