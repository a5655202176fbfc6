"""Which FORCE and COMPENSATE comments are in force at the steps of a run, whatever it does at branches.

A branch, a loop or a jump of which it is not known what it does is a piece with arms: what is in force behind it is
what all of them leave, and what was in force ahead where none may run.
"""

from __future__ import annotations

from functools import reduce
from typing import NamedTuple

import numpy as np

from postproc.base.arrays import Bools
from postproc.languages.core.comments_in_force import VARYING, Comment, Varying, join_comments, place_of
from postproc.languages.gcode.execution import Execution
from postproc.languages.gcode.execution_flow import ONE_ARM_RUNS, STRAIGHT, ExecutionFlow, FlowReason
from postproc.toolpath import Annotation


class CommentPassed(NamedTuple):
    """A comment ahead of the block of a step, ``alone``, or in its line; sure: the run passes it where it comes by."""

    comment: Annotation
    step: int
    alone: bool
    sure: bool


_AFTER_CALL, _INTO, _AHEAD, _OUT, _BESIDE = range(5)
"""What is first of one step."""


def varying_comments(passed: list[CommentPassed], execution: Execution, flow: ExecutionFlow) -> Bools:
    """(E,) steps at which it differs with the path of the program which comment is in force."""
    steps = len(flow.reason)
    varying = np.zeros(steps + 1, np.bool_)
    for place in ("force", "switch"):
        own = [one for one in passed if place_of(one.comment.text) == place]
        if own:
            varying[:steps] |= _varying(own, execution, flow)
    return varying[:steps]


def _varying(passed: list[CommentPassed], execution: Execution, flow: ExecutionFlow) -> Bools:
    """The same of the comments of one kind."""
    events = [(one.step, _AHEAD if one.alone else _BESIDE, at) for at, one in enumerate(passed)]
    pieces = execution.perhaps.tolist()
    inside = np.zeros(len(flow.reason) + 2, np.int32)
    for number, (first, last, _, _) in enumerate(pieces):
        events += [(first, _INTO, number), (last, _OUT, number)]
        inside[[first, last + 1]] += [1, -1]
    elsewhere = np.isin(flow.reason, (FlowReason.PROGRAM, FlowReason.FLOW))
    elsewhere = np.append(elsewhere & (np.cumsum(inside)[:-2] == 0), False)
    if any(elsewhere[one.step] for one in passed):  # what a call that is not followed may pass
        events += [(step + 1, _AFTER_CALL, step) for step in np.flatnonzero(flow.calls).tolist()]
    here: Comment | Varying | None = None
    ahead, behind, straight = here, [here], True
    changes, states = [0], [False]
    for step, what, which in sorted(events):
        if what == _AFTER_CALL:
            here = VARYING
        elif what == _INTO:
            _, _, group, kind = pieces[which]
            if not which or pieces[which - 1][2] != group:
                ahead, behind = here, [] if kind & ONE_ARM_RUNS else [here]
            straight = bool(kind & STRAIGHT)
        elif what == _OUT:
            behind.append(here)
            here, straight = ahead, True
            if which + 1 == len(pieces) or pieces[which + 1][2] != pieces[which][2]:
                here = reduce(join_comments, behind)
        else:
            one = passed[which]
            here = one.comment if one.sure and straight else join_comments(here, one.comment)
        changes.append(step)
        states.append(here is VARYING)
    until = np.append(changes[1:], len(flow.reason) + 1)
    return np.repeat(states, until - np.array(changes))[: len(flow.reason)]
