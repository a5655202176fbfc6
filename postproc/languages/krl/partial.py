"""Targets that leave components out: what the point before gives them."""

from __future__ import annotations

from functools import lru_cache

from postproc.languages.krl.modal_state import NOT_TO_TARGET, Anchor, ModalState
from postproc.languages.krl.motion_rows import RowRefusal
from postproc.languages.krl.spatial import Numbers
from postproc.languages.krl.target import KrlTarget, Six, six


def filled(own: Six, before: Numbers | None) -> Numbers | None:
    """The components with the missing ones from the point before; None if that is not known."""
    x, y, z, a, b, c = own
    if (
        x is not None and y is not None and z is not None
        and a is not None and b is not None and c is not None
    ):  # fmt: skip
        return (x, y, z, a, b, c)
    if before is None:
        return None
    u, v, w, d, e, f = (old if new is None else new for new, old in zip(own, before, strict=True))
    return (u, v, w, d, e, f)


def anchored(own: Six, anchor: Anchor) -> tuple[Numbers | None, Anchor | None]:
    """The components with those of ``anchor``: all six, or what is then still left to its axis motion.

    Of A, B, C all three or none must be left: how the controller writes an orientation is its own choice.
    """
    given = six([old if new is None else new for new, old in zip(own, anchor.partial_target, strict=True)])
    full = filled(given, None)
    if full is not None:
        return full, None
    open_angles = [value is None for value in given[3:]]
    return None, Anchor(anchor.row, given) if all(open_angles) or not any(open_angles) else None


def varying(state: ModalState, target: KrlTarget, values: Numbers) -> RowRefusal | None:
    """Why components that the point before gives are not known, though others are."""
    left_out = zip(target.values, values, strict=True)
    lost = [i for i, (own, value) in enumerate(left_out) if own is None and value != value]
    if not lost or (lost[0] >= 3 and state.orientation in NOT_TO_TARGET):
        return None
    names = ", ".join("XYZABC"[i] for i in lost)
    why = state.point_unknown
    return _omits(names, why)


def incomplete(state: ModalState, target: KrlTarget, values: Numbers | None) -> RowRefusal | None:
    frames = state.point_frames
    changed = target.axes is None and frames is not None and frames != (state.base, state.tool)
    if not changed and values is not None:
        return None
    names = target.missing
    if changed:
        return RowRefusal(
            "KRL017", f"the point omits {names}, and base or tool changed since the point before"
        )
    if values is None:
        why = state.point_unknown
        if target.axes is not None and not why.startswith("no motion"):
            why = "the motion before it does not define the axes"
        return _omits(names, why)
    return None


@lru_cache(maxsize=1024)
def _omits(names: str, why: str) -> RowRefusal:
    return RowRefusal("KRL004", f"the point omits {names}, and the position is not known: {why}", why)
