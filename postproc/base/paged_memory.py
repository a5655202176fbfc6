"""Programs larger than memory: inside of ``large_arrays_in_files`` large arrays and byte strings lie in temporary
files.

The system writes such pages to the disk and fetches them again as they are asked for, so that what is resident does not
grow with the program.  The files have no name: whatever ends the process, nothing of them stays.
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
from itertools import chain
from pathlib import Path
from types import FrameType
from typing import Any, TypeVar

from postproc.base.array_memory import handler_for, is_allocating, set_handler
from postproc.base.findings import Code, Finding, Refusal, define

T = TypeVar("T")

PROGRAM = 16 << 20
"""Bytes of a program from which on its arrays are in files: a quarter of a million motions."""

LARGE = 8 << 20
"""Bytes of an array, or of a byte string, that is in a file."""

RESIDENT = 256 << 20
"""Bytes of files that may be resident before all of them are given back."""

WAITING = 256 << 20
"""Bytes of files that are free and wait for the next array of their size: a new one takes longer to fill."""

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
_IS_MMAPPED = 2
_MAP_FIXED = 0x10

_libc = ctypes.CDLL(None) if sys.platform == "linux" else None

current_storage: ContextVar[PagedStorage | None] = ContextVar("current_storage", default=None)


@contextmanager
def large_arrays_in_files(*programs: Path) -> Iterator[None]:
    """What is computed inside of it from ``programs`` that are together larger than ``PROGRAM`` takes memory that is
    bounded, and room for temporary files; smaller ones, and systems without such files, are computed in memory as
    always.

    Raises Refusal FIL013 where neither the disk nor the memory has enough room.
    """
    size, folder = sum(map(_size, programs)), None
    if sys.platform == "linux" and current_storage.get() is None and size >= PROGRAM:
        folder = temporary_folder(ROOM * size, programs[0])
    if folder is None:
        yield
        return
    storage = PagedStorage(folder)
    token, before = current_storage.set(storage), set_handler(handler_for(storage))
    try:
        with storage.watched():
            yield
    finally:
        set_handler(before)
        current_storage.reset(token)
        storage.close()


def in_file(text: bytes) -> bytes:
    """The very ``text``; if it is large its pages are those of a temporary file from now on."""
    storage = current_storage.get()
    if storage is not None and len(text) >= LARGE:
        storage.move(text)
    return text


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


class PagedStorage:
    """The temporary files of one run: one for each array, which ends with it."""

    def __init__(self, folder: str) -> None:
        self.folder, self.least = folder, LARGE
        # by address; the second of a pair keeps the first open
        self.files: dict[int, tuple[mmap.mmap, Any]] = {}
        # by length
        self.free: dict[int, list[tuple[mmap.mmap, Any]]] = {}
        self.waiting = self.since = 0
        self.moved: list[tuple[bytes, int, int]] = []

    def new(self, size: int, zeros: bool) -> int:
        """See ``ArrayPlace``."""
        length = -(-size // _STEP) * _STEP
        self.since += length
        if self.since > LOOK:
            self.release()
        waiting = self.free.get(length)
        if waiting:
            file = waiting.pop()
            self.waiting -= length
            if zeros:
                ctypes.memset(ctypes.addressof(file[1]), 0, size)
        else:
            try:
                with tempfile.TemporaryFile(dir=self.folder, buffering=0) as stream:
                    # a page for which the disk has no room later would end the process
                    os.posix_fallocate(stream.fileno(), 0, length)
                    mapped = mmap.mmap(stream.fileno(), length)
            except OSError:
                return 0
            file = mapped, ctypes.c_char.from_buffer(mapped)
        address = ctypes.addressof(file[1])
        self.files[address] = file
        return address

    def size_at(self, address: int) -> int:
        """See ``ArrayPlace``."""
        return len(self.files[address][0]) if address in self.files else 0

    def give_back(self, address: int) -> bool:
        """See ``ArrayPlace``."""
        file = self.files.pop(address, None)
        if file is None:
            return False
        length = len(file[0])
        if self.waiting + length <= WAITING:
            self.waiting += length
            self.free.setdefault(length, []).append(file)
        return True

    def move(self, text: bytes) -> None:
        """Puts a file with the same bytes in the place of the whole pages of ``text``."""
        at = id(text) + bytes.__basicsize__ - 1
        start, stop = -(-at // _PAGE) * _PAGE, (at + len(text)) // _PAGE * _PAGE
        if not _has_pages_of_its_own(text) or any(one is text for one, _, _ in self.moved):
            return
        try:
            with tempfile.TemporaryFile(dir=self.folder, buffering=0) as stream:
                os.posix_fallocate(stream.fileno(), 0, stop - start)
                rest = memoryview(text)[start - at : stop - at]
                while len(rest):
                    rest = rest[stream.write(rest) :]
                _map_over(start, stop - start, stream.fileno())
        except OSError:
            return
        # kept to its end: pages may be given back as long as nobody else can get their place
        self.moved.append((text, start, stop - start))
        self.release()

    def release(self) -> None:
        """See ``release_pages``.  The pages of a file keep what they hold."""
        self.since = 0
        with open("/proc/self/statm", "rb") as stream:
            if int(stream.read().split()[2]) * _PAGE < RESIDENT:
                return
        for mapped, _ in chain(list(self.files.values()), *list(self.free.values())):
            mapped.madvise(mmap.MADV_DONTNEED)
        if _libc is not None:
            for _, start, length in self.moved:
                _libc.madvise(ctypes.c_void_p(start), ctypes.c_size_t(length), mmap.MADV_DONTNEED)

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
        """Keep nothing that is not asked for any more."""
        self.moved.clear()
        self.free.clear()
        self.waiting = WAITING


def _has_pages_of_its_own(text: bytes) -> bool:
    """Whether the C library (glibc) keeps ``text`` in a mapping of its own, which ends with it: such a block starts
    with a page, and its head states 0, then its size in whole pages with one bit (malloc/malloc.c, IS_MMAPPED)."""
    if not hasattr(_libc, "gnu_get_libc_version") or "PYTHONMALLOC" in os.environ or sys.flags.dev_mode:
        return False
    head = id(text) - 16
    if head % _PAGE:
        return False
    zero, size = (ctypes.c_size_t * 2).from_address(head)
    return zero == 0 and size % _PAGE == _IS_MMAPPED and 0 <= size - len(text) < 2 * _PAGE


def _map_over(address: int, length: int, file: int) -> None:
    """Puts the first ``length`` bytes of an open ``file`` in the place of the pages from ``address``."""
    if _libc is None:
        return
    function = _libc.mmap
    function.restype = ctypes.c_void_p
    function.argtypes = (ctypes.c_void_p, ctypes.c_size_t, *(ctypes.c_int,) * 3, ctypes.c_long)
    access = mmap.PROT_READ | mmap.PROT_WRITE
    if function(address, length, access, mmap.MAP_SHARED | _MAP_FIXED, file, 0) != address:
        raise MemoryError("a temporary file cannot take the place of memory")


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
    if _free_memory() < room:
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


def _free_memory() -> int:
    """Bytes that programs may still take without swapping."""
    with open("/proc/meminfo") as stream:
        lines = dict(line.split(":") for line in stream)
    return int(lines["MemAvailable"].split()[0]) << 10
