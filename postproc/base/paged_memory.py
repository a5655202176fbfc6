"""Programs larger than memory: inside of ``large_arrays_in_files`` large arrays and byte strings lie in temporary
files.

What is resident does not grow with the program: the system takes such pages back, writes them to the disk where it
needs their place, and fetches them again as they are asked for.  The files have no name: whatever ends the process,
nothing of them stays.
"""

from __future__ import annotations

import ctypes
import mmap
import os
import signal
import sys
import tempfile
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass
from pathlib import Path
from types import FrameType
from typing import IO, Any, TypeVar

from postproc.base.array_memory import handler_for, is_allocating, set_handler
from postproc.base.findings import Code, Finding, Refusal, define
from postproc.base.memory import free_memory, without_garbage_collection

T = TypeVar("T")

PROGRAM = 16 << 20
"""Bytes of a program from which on its arrays are in files: a quarter of a million motions."""

LARGE = 8 << 20
"""Bytes of an array, or of a byte string, that is in a file."""

RESIDENT = 256 << 20
"""Bytes of files that may be resident before all of them are given back: twice as many bring no time."""

WAITING = 2 << 30
"""Bytes of files that are free and wait for the next array: to fill a new one takes ten times as long."""

LOOK = 32 << 20
"""Bytes of new arrays between two looks at what is resident."""

EVERY = 0.02
"""[s] Between two looks at what is resident."""

ROOM = 20
"""Bytes of temporary files, and of results, for each byte of a program."""

CODES = define(
    {
        "FIL013": Code(
            "error",
            "no room for a program of this size",
            meaning="A large program needs temporary files or memory, and neither has enough room.",
            consequence="The command does not start; nothing is written.",
            action="Free room on the disk, or set TMPDIR to a folder on a disk that has it.",
            example="A program of 600 MB with 5 GB of free disk on a machine with 4 GB of memory.",
        )
    }
)

_PAGE = mmap.PAGESIZE
_STEP = 16 * _PAGE
_LEAF = _PAGE * _PAGE // 8
_HEAD, _IS_MMAPPED = 16, 2
_MAP_FIXED, _NOT_NEEDED_NOW = 0x10, 4
_MMAP_THRESHOLD, _TRIM_THRESHOLD = -3, -1

_MEMORY = "/proc/self/mem"
_FIRST_PAGE_ALONE = bytes(_HEAD // 2) + (_PAGE | _IS_MMAPPED).to_bytes(_HEAD // 2, sys.byteorder)
"""The head of a block of the C library that is one page."""

_libc: Any = ctypes.CDLL(None) if sys.platform == "linux" else None
_libc_at_once: Any = ctypes.PyDLL(None) if sys.platform == "linux" else None
"""The same, whose functions keep the lock of the interpreter: to get it back takes 5 ms for each thread that computes,
as long as many files' pages."""

current_storage: ContextVar[PagedStorage | None] = ContextVar("current_storage", default=None)


@contextmanager
def large_arrays_in_files(*programs: Path) -> Iterator[None]:
    """What is computed inside of it from ``programs`` that are together larger than ``PROGRAM`` takes memory that is
    bounded, and room for temporary files; smaller ones, and systems without such files, are computed in memory as
    always.

    Raises Refusal FIL013 where neither the disk nor the memory has enough room.
    """
    size, folder = sum(map(_size, programs)), None
    if _has_pages_of_arrays() and current_storage.get() is None and size >= PROGRAM:
        folder = temporary_folder(ROOM * size, programs[0])
    if folder is None:
        yield
        return
    # from LARGE on always, and not from the largest block on that was ever given back
    _libc.mallopt(_MMAP_THRESHOLD, LARGE)
    _libc.mallopt(_TRIM_THRESHOLD, 2 * LARGE)
    storage = PagedStorage(folder)
    token, before = current_storage.set(storage), set_handler(handler_for(storage, _usable))
    try:
        with storage.watched():
            yield
    finally:
        set_handler(before)
        current_storage.reset(token)
        storage.close()


def room_in_file(text: bytes) -> None:
    """Bytes that hold nothing yet: if there are many, their pages are those of a temporary file from now on.

    Raises MemoryError where the pages are lost."""
    storage = current_storage.get()
    if (
        storage is not None
        and len(text) >= LARGE
        and not storage.take_over(id(text), sys.getsizeof(text), False)
    ):
        raise MemoryError("a temporary file cannot take the place of memory")


def release_pages() -> None:
    """Give the pages of temporary files back to the system if more than ``RESIDENT`` bytes of them are resident."""
    storage = current_storage.get()
    if storage is not None:
        storage.release()


def with_small_arrays(work: Callable[[Any], T], part: Any) -> T:
    """``work(part)`` of a block, whose arrays are allocated as always: that is faster."""
    if current_storage.get() is None:
        return work(part)
    before = set_handler(None)
    try:
        return work(part)
    finally:
        set_handler(before)


@dataclass(eq=False)
class PageFile:
    """A file without a name for the pages of one array after another.  ``address``: where ``mapped`` [bytes] of it
    are, 0: nowhere yet."""

    stream: IO[bytes]
    length: int
    address: int = 0
    mapped: int = 0


class PagedStorage:
    """The temporary files of one run.

    The first page of such an array is memory of the C library, which takes that alone back when the array ends: its
    head says that there is no more.  So what is mapped behind it is the storage's own until it is unmapped here, and
    giving its pages back can touch no other memory, whenever the array ends.  A file that serves no array any more
    serves the next one.
    """

    def __init__(self, folder: str) -> None:
        self.folder, self.least = folder, LARGE
        self.files: list[PageFile] = []
        """Those that are mapped; their arrays may be gone."""
        self.waiting: list[PageFile] = []
        self.since = 0
        self.closed = False
        self._lists = threading.RLock()
        self._memory = os.open(_MEMORY, os.O_RDONLY)

    def take_over(self, address: int, size: int, zeros: bool) -> bool:
        """See ``ArrayPlace``."""
        # the first page keeps the head by which the C library knows what is its own
        start, length = address - _HEAD + _PAGE, _bytes_of_pages(address, size) - _PAGE
        if length <= 0 or self.closed:
            return True
        self.since += length
        if self.since > LOOK:
            self.release()
        with self._lists:
            file = self._file_of(length)
            if file is None:
                return True
            if not _map_over(start, length, file.stream):
                return False
            _set_pages(address, _PAGE)
            used, file.address, file.mapped = bool(file.address), start, length
            self.files.append(file)
        if zeros and used:
            ctypes.memset(start, 0, length)
        return True

    def bytes_at(self, address: int) -> int:
        """See ``ArrayPlace``."""
        start = address - _HEAD + _PAGE
        return next((_PAGE - _HEAD + file.mapped for file in self.files if file.address == start), 0)

    def _file_of(self, length: int) -> PageFile | None:
        """A file with room for ``length`` bytes that is not mapped; None where the disk has no room."""
        for file in [file for file in self.files if self._is_gone(file)]:
            _unmap(file)
            self.files.remove(file)
            self.waiting.append(file)
        length = -(-length // _STEP) * _STEP + _LEAF
        fitting = [file for file in self.waiting if length <= file.length <= 2 * length]
        if fitting:
            found = min(fitting, key=lambda file: file.length)
            self.waiting.remove(found)
            return found
        self._keep_waiting(WAITING)
        new = self._new_file(length)
        if new is None and self.waiting:  # the disk may be full of them
            self._keep_waiting(0)
            new = self._new_file(length)
        return new

    def _keep_waiting(self, most: int) -> None:
        """Ends the oldest of the files that wait, until they have ``most`` bytes at most."""
        while sum(file.length for file in self.waiting) > most:
            self.waiting.pop(0).stream.close()

    def _new_file(self, length: int) -> PageFile | None:
        """A file of ``length`` bytes; None where the disk has no room."""
        try:
            stream = tempfile.TemporaryFile(dir=self.folder, buffering=0)  # noqa: SIM115  as long as it is mapped
        except OSError:
            return None
        try:
            # a page for which the disk has no room later would end the process
            os.posix_fallocate(stream.fileno(), 0, length)
        except OSError:
            stream.close()
            return None
        return PageFile(stream, length)

    def _is_gone(self, file: PageFile) -> bool:
        """Whether the array of a file is at its end: the C library has taken back its first page, with the head that is
        written nowhere else."""
        try:
            head = os.pread(self._memory, _HEAD, file.address - _PAGE)
        except OSError:
            return True
        return head != _FIRST_PAGE_ALONE

    def release(self) -> None:
        """See ``release_pages``.  The pages of a file keep what they hold."""
        self.since = 0
        with open("/proc/self/statm", "rb") as stream:
            if int(stream.read().split()[2]) * _PAGE < RESIDENT:
                return
        with self._lists:
            for file in self.files:
                address, length = ctypes.c_void_p(file.address), ctypes.c_size_t(file.mapped)
                _libc_at_once.madvise(address, length, _NOT_NEEDED_NOW)

    @contextmanager
    def watched(self) -> Iterator[None]:
        """Gives pages back beside the work as well: one operation on a large array may touch all of them.

        A signal that comes while numpy asks for memory is heard a moment later: what its handler raises would be lost.
        """
        done = threading.Event()
        handlers = _handlers()
        late: list[int] = []

        def hear(number: int, frame: FrameType | None) -> None:
            if is_allocating(frame):
                late.append(number)
            else:
                handlers[number](number, frame)

        def watch() -> None:
            while not done.wait(EVERY):
                self.release()
                while late:
                    os.kill(os.getpid(), late.pop())

        thread = threading.Thread(target=watch, name="pages", daemon=True)
        for number in handlers:
            signal.signal(number, hear)
        thread.start()
        try:
            yield
        finally:
            done.set()
            thread.join()
            for number, handler in handlers.items():
                signal.signal(number, handler)
            for number in late:
                signal.raise_signal(number)

    def close(self) -> None:
        """Keep nothing that is not asked for any more; the C library takes back all of an array that is still there."""
        # no array may end between the look at its head and the writing to it
        with self._lists, without_garbage_collection():
            for file in self.files:
                if self._is_gone(file):
                    _unmap(file)
                else:
                    _set_pages(file.address - _PAGE + _HEAD, _PAGE + file.mapped)
            for file in [*self.files, *self.waiting]:
                file.stream.close()
            self.files.clear()
            self.waiting.clear()
            self.closed = True
            os.close(self._memory)


def _has_pages_of_arrays() -> bool:
    """Whether the C library is one (glibc) of which it is known how it keeps large blocks, and the process may look
    into its own memory."""
    return hasattr(_libc, "gnu_get_libc_version") and os.access(_MEMORY, os.R_OK)


def _usable(address: int) -> int:
    """Bytes of the block at ``address``."""
    function = _libc.malloc_usable_size
    function.restype, function.argtypes = ctypes.c_size_t, (ctypes.c_void_p,)
    return int(function(address))


def _bytes_of_pages(address: int, size: int) -> int:
    """The bytes of the pages, from the one with ``address`` on, that the C library (glibc) keeps for it alone, 0 where
    it does not: such a block starts with a page, and its head states 0, then its size in whole pages with one bit
    (malloc/malloc.c, IS_MMAPPED)."""
    head = address - _HEAD
    if head % _PAGE:
        return 0
    zero, length = (ctypes.c_size_t * 2).from_address(head)
    length -= _IS_MMAPPED
    return length if zero == 0 and length % _PAGE == 0 and 0 <= length - size < 2 * _PAGE else 0


def _set_pages(address: int, length: int) -> None:
    """States in the head of the block at ``address`` how many bytes the C library takes back with it."""
    ctypes.c_size_t.from_address(address - _HEAD // 2).value = length | _IS_MMAPPED


def _map_over(address: int, length: int, file: IO[bytes]) -> bool:
    """Puts ``length`` bytes of ``file`` in the place of the pages at ``address``; False where that failed, and they
    must not be used.  They begin in the file as far behind a leaf as in memory, so that the system maps whole leaves:
    page by page it takes twenty times as long to write to them again."""
    function = _libc.mmap
    function.restype = ctypes.c_void_p
    function.argtypes = (ctypes.c_void_p, ctypes.c_size_t, *(ctypes.c_int,) * 3, ctypes.c_long)
    access, flags = mmap.PROT_READ | mmap.PROT_WRITE, mmap.MAP_SHARED | _MAP_FIXED
    return bool(function(address, length, access, flags, file.fileno(), address % _LEAF) == address)


def _unmap(file: PageFile) -> None:
    """Takes back what is mapped of a file whose array is gone."""
    _libc.munmap(ctypes.c_void_p(file.address), ctypes.c_size_t(file.mapped))


def _handlers() -> dict[int, Callable[[int, FrameType | None], Any]]:
    """The Python functions that hear what ends a run; they are called in the main thread alone."""
    if threading.current_thread() is not threading.main_thread():
        return {}
    heard = {
        int(number): signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
    }
    return {number: handler for number, handler in heard.items() if callable(handler)}


def _size(path: Path) -> int:
    try:
        return path.stat().st_size
    except (OSError, ValueError):
        return 0


def temporary_folder(room: int, program: Path) -> str | None:
    """The first folder for temporary files on a disk with ``room`` bytes; None where there is none, but memory.

    Raises Refusal (FIL013) where neither a disk nor the memory has as much.
    """
    names = [name for name in (os.environ.get("TMPDIR"), "/var/tmp", tempfile.gettempdir()) if name]
    disks = [name for name in names if os.path.isdir(name) and os.access(name, os.W_OK) and _is_on_disk(name)]
    most = 0
    for name in disks:
        status = os.statvfs(name)
        most = max(most, status.f_bavail * status.f_frsize)
        if most >= room:
            return name
    if (free_memory() or 0) < room:
        message = (
            f"the disk has {most / 1e9:.1f} GB free, and this program needs up to {room / 1e9:.1f} GB there"
        )
        help = f"free room in {names[0]}, or set TMPDIR to a folder on a disk that has it"
        raise Refusal(Finding("FIL013", message, str(program), help=help))
    return None


def _is_on_disk(folder: str) -> bool:
    """Whether a folder is no part of memory itself."""
    device = os.stat(folder).st_dev
    there = f"{os.major(device)}:{os.minor(device)}"
    with open("/proc/self/mountinfo") as stream:
        kinds = {line.partition(" - ")[2].split()[0] for line in stream if line.split()[2] == there}
    return bool(kinds) and not kinds & {"tmpfs", "ramfs"}
