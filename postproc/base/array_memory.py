"""numpy's own interface for the memory of arrays (NEP 49, ``PyDataMem_SetHandler``), without a compiler.

A handler holds for one context: threads that work on blocks, whose arrays are small, allocate as always.
"""

from __future__ import annotations

import ctypes
from collections.abc import Callable
from functools import cache
from types import FrameType
from typing import Any, Protocol

SET_HANDLER = 304
"""Number of ``PyDataMem_SetHandler`` in numpy's table of functions (numpy/__multiarray_api.h); it never changes."""

_NAME = b"mem_handler"

_MALLOC = ctypes.c_void_p, ctypes.c_void_p, ctypes.c_size_t
_CALLOC = ctypes.c_void_p, ctypes.c_void_p, ctypes.c_size_t, ctypes.c_size_t
_REALLOC = ctypes.c_void_p, ctypes.c_void_p, ctypes.c_void_p, ctypes.c_size_t
_FREE = None, ctypes.c_void_p, ctypes.c_void_p, ctypes.c_size_t

_for_ever: list[Any] = []
"""Handlers: an array may outlive all else."""

_codes: set[Any] = set()
"""The code of the functions that numpy calls."""


class ArrayPlace(Protocol):
    """Where the pages of large arrays lie."""

    least: int
    """Bytes of an array whose pages lie there."""

    def take_over(self, address: int, size: int, zeros: bool) -> bool:
        """Put other pages in the place of ``size`` bytes at ``address``, which hold nothing yet or ``zeros``; memory
        stays as it is where there is no room for them.  False where it is lost and must not be used."""

    def bytes_at(self, address: int) -> int:
        """Bytes at ``address`` where those of an array lie there, else 0: the C library knows nothing of them."""


class _Allocator(ctypes.Structure):
    """``PyDataMemAllocator`` of numpy/ndarraytypes.h."""

    _fields_ = [(name, ctypes.c_void_p) for name in ("ctx", "malloc", "calloc", "realloc", "free")]


class _Handler(ctypes.Structure):
    """``PyDataMem_Handler`` of numpy/ndarraytypes.h."""

    _fields_ = [("name", ctypes.c_char * 127), ("version", ctypes.c_uint8), ("allocator", _Allocator)]


_new_capsule = ctypes.PYFUNCTYPE(ctypes.py_object, ctypes.c_void_p, ctypes.c_char_p, ctypes.c_void_p)(
    ("PyCapsule_New", ctypes.pythonapi)
)
_address_in = ctypes.PYFUNCTYPE(ctypes.c_void_p, ctypes.py_object, ctypes.c_char_p)(
    ("PyCapsule_GetPointer", ctypes.pythonapi)
)


def set_handler(handler: Any) -> Any:
    """Makes ``handler`` that of this context, None: numpy's own; returns the one before."""
    return _set_handler()(None if handler is None else id(handler))


def handler_for(place: ArrayPlace, usable: Callable[[int], int]) -> Any:
    """A handler that puts the pages of large arrays into ``place``; ``usable``: bytes at an address of the C library.

    What is asked for comes from numpy's own functions, and goes back by them: they run while exceptions are on their
    way, which a Python function would lose.
    """
    before = set_handler(None)
    usual = _Handler.from_address(_address_in(set_handler(before), _NAME)).allocator
    # numpy's own functions expect the lock of the interpreter, which PYFUNCTYPE keeps
    malloc = ctypes.PYFUNCTYPE(*_MALLOC)(usual.malloc)
    calloc = ctypes.PYFUNCTYPE(*_CALLOC)(usual.calloc)
    realloc = ctypes.PYFUNCTYPE(*_REALLOC)(usual.realloc)
    free = ctypes.PYFUNCTYPE(*_FREE)(usual.free)
    # bound here: at the end of the process the names of modules may be gone before the last array
    take_over, bytes_at, least, move = place.take_over, place.bytes_at, place.least, ctypes.memmove

    def allocate(_: int | None, size: int) -> int | None:
        address: int | None = malloc(None, size)
        if address and size >= least and not take_over(address, size, False):
            return None
        return address

    def allocate_zeros(_: int | None, count: int, size: int) -> int | None:
        address: int | None = calloc(None, count, size)
        if address and count * size >= least and not take_over(address, count * size, True):
            return None
        return address

    def change_size(_: int | None, address: int, size: int) -> int | None:
        old = bytes_at(address) if address else 0
        if not address or (size < least and not old):
            same: int | None = realloc(None, address, size)
            return same
        there = allocate(None, size)
        if there:
            old = old or usable(address)
            move(there, address, min(size, old))
            free(None, address, old)
        return there

    functions = (allocate, _MALLOC), (allocate_zeros, _CALLOC), (change_size, _REALLOC)
    calls = [ctypes.CFUNCTYPE(*types)(function) for function, types in functions]
    addresses = (ctypes.cast(call, ctypes.c_void_p).value for call in calls)
    handler = _Handler(b"postproc_files", 1, _Allocator(None, *addresses, usual.free))
    _codes.update(function.__code__ for function, _ in functions)
    _for_ever.append((handler, calls))
    return _new_capsule(ctypes.addressof(handler), _NAME, None)


def is_allocating(frame: FrameType | None) -> bool:
    """Whether a frame belongs to what numpy called for memory: an exception would be lost there."""
    while frame is not None:
        if frame.f_code in _codes:
            return True
        frame = frame.f_back
    return False


@cache
def _set_handler() -> Callable[[int | None], Any]:
    from numpy._core.multiarray import _ARRAY_API

    table = ctypes.cast(_address_in(_ARRAY_API, None), ctypes.POINTER(ctypes.c_void_p))
    function: Callable[[int | None], Any] = ctypes.PYFUNCTYPE(ctypes.py_object, ctypes.c_void_p)(
        table[SET_HANDLER]
    )
    return function
