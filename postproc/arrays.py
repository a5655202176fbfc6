"""Arrays as the rest of the house holds them: of a stated shape, and read-only."""

from __future__ import annotations

from typing import Any, TypeGuard

import numpy as np
from numpy.typing import ArrayLike, NDArray

Floats = NDArray[np.float64]
Ints = NDArray[np.signedinteger[Any]]
Bools = NDArray[np.bool_]


def frozen(values: ArrayLike, shape: tuple[int, ...] | None = None, dtype: Any = np.float64) -> NDArray[Any]:
    """A read-only, C-ordered copy of ``values``; -1 in ``shape`` stands for any length.  What is read-only already and
    owns its data, or is one value broadcast, is taken as it is.

    Raises ValueError when the shape is another one: a defect of the program, never of its input.
    """
    array = values if _is_frozen(values, dtype) else np.array(values, dtype=dtype, order="C")
    if shape is not None and (
        array.ndim != len(shape)
        or any(want not in (-1, have) for want, have in zip(shape, array.shape, strict=True))
    ):
        raise ValueError(f"array of shape {array.shape} where {shape} is meant")
    array.setflags(write=False)
    return array


def _is_frozen(values: ArrayLike, dtype: Any) -> TypeGuard[NDArray[Any]]:
    if not isinstance(values, np.ndarray) or values.flags.writeable or values.dtype != dtype:
        return False
    return bool(values.flags.owndata and values.flags.c_contiguous) or (
        values.size > 0 and not any(values.strides)
    )
