"""Arrays that compiled code reads and writes without counting its references to them.

Numba counts the references to an array at every call of a function that is given it, by an instruction that locks the
memory; in functions of some dozen operations that is most of the time, and threads wait for each other.  A view that
belongs to nobody is not counted.  Whoever calls the compiled code holds the arrays meanwhile, and no view outlives the
call; an array that a function makes itself it has to ``keep_alive``.
"""

from __future__ import annotations

import importlib
from typing import Any

from postproc.base.arrays import Floats
from postproc.process.stock.compiled import compiled

_extending: Any = importlib.import_module("numba.extending")
_cgutils: Any = importlib.import_module("numba.core.cgutils")


def _typed(context: Any, array: Any) -> tuple[Any, Any]:
    """The type of the view is that of the array; what makes it is the array without its owner."""

    def build(target: Any, builder: Any, signature: Any, values: Any) -> Any:
        view = target.make_array(array)(target, builder, values[0])
        view.meminfo = _cgutils.get_null_value(view.meminfo.type)
        view.parent = _cgutils.get_null_value(view.parent.type)
        return view._getvalue()

    return array(array), build


@compiled
def keep_alive(array: Floats) -> int:
    """Called after the last use of what is ``borrowed`` from an ``array`` (K, ...) of the same function: until here it
    exists."""
    return len(array)


borrowed: Any = _extending.intrinsic(_typed)
"""In compiled code: the array without its owner."""
