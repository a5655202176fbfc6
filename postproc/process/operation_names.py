"""The name of the operation of every motion, under which what is learnt of its force is kept."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from postproc.base.arrays import Ints
from postproc.process.operations import join
from postproc.process.process_file import Operation
from postproc.toolpath import Toolpath

_NAMED = re.compile(r"operation\b\s*[-:.#0-9]*\s*[-:]?\s*(?P<name>.*)", re.IGNORECASE)


@dataclass(frozen=True, eq=False)
class OperationNames:
    """``names`` of operations; ``which`` (N,): index of each motion's."""

    names: tuple[str, ...]
    which: Ints


def name_operations(toolpath: Toolpath, operations: Sequence[Operation] = ()) -> OperationNames:
    """By the process file's ``operations`` where they have a motion, else by the comments ``OPERATION ...`` of the
    program, else by the number of the tool."""
    count = len(toolpath)
    numbers = np.array([frame.entry or 0 for frame in toolpath.frames] + [0])[toolpath.tool]
    labels = np.array([f"tool {number}" for number in numbers.tolist()], dtype=object)
    places = []
    for comment in sorted(toolpath.comments, key=lambda one: (one.row, one.line)):
        named = _NAMED.match(" ".join(comment.text.split()))
        if named is not None and named["name"]:
            places.append((comment.row, named["name"].upper()))
    for index, (row, name) in enumerate(places):
        end = places[index + 1][0] if index + 1 < len(places) else count
        labels[row:end] = name
    if operations:
        owner = join(operations, toolpath)
        for index, operation in enumerate(operations):
            labels[owner == index] = operation.name.upper() or operation.label
    names, which = np.unique(labels.astype(str), return_inverse=True)
    return OperationNames(tuple(str(name) for name in names), np.asarray(which))
