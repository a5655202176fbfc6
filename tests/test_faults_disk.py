"""A disk that fails at any request, that is full, or that is read-only: all files as they were, and words for it."""

from __future__ import annotations

import errno
import os
import shutil
from pathlib import Path

import pytest
from disks import a_disk, failing
from faults import KILLS, Child, once, stray, there

OLD, NEW = "--force=0,50,0", "--force=0,150,0"
PAGE = os.sysconf("SC_PAGESIZE")
STEP = 29 if KILLS == 5 else 5
"""Pages by which a small disk grows."""


@pytest.fixture
def shop(job):
    """A program with a data list, its old and its new results, and how to begin anew with the old ones."""
    job.write(["DEFDAT part", "DECL REAL X=1.0", "ENDDAT"], name="part.dat")
    folder, made = job.output.parent, []
    for force in (OLD, NEW):
        assert Child([job.program, force], job.folder).end() in (0, 3)
        made.append(there(folder))

    def begin() -> None:
        shutil.rmtree(folder, ignore_errors=True)
        folder.mkdir()
        for name, content in made[0].items():
            (folder / name).write_bytes(content)

    return job, folder, made[0], made[1], begin


def refused(child: Child) -> None:
    assert child.end() == 1, child.said
    assert "FIL004" in child.said
    assert "nothing is written" in child.said
    assert "Traceback" not in child.said


@pytest.mark.slow
@pytest.mark.parametrize(
    ("kind", "code", "most"),
    [
        ("write", errno.ENOSPC, 100),
        ("write", errno.EIO, 3),
        ("write", errno.EDQUOT, 3),
        ("sync", errno.EIO, 100),
        ("sync", errno.ENOSPC, 2),
        ("rename", errno.ENOSPC, 100),
        ("rename", errno.EROFS, 2),
        ("rename", errno.EXDEV, 2),
    ],
)
def test_every_request_to_the_disk_fails_once(shop, kind, code, most):
    """Whichever write, sync or renaming fails: old files as they were, no other file, a sentence that says why."""
    job, folder, old, new, begin = shop
    failed = 0
    for at in range(1, most + 1):
        begin()
        child = Child([job.program, NEW], folder, once(1, lambda at=at: failing(kind, at, code, folder)))
        ended = child.end()
        if "disk failed" not in child.said:
            break
        if (
            kind == "sync" and ended != 1
        ):  # not every file system syncs folders: that one is no reason to stop
            assert there(folder) == new
            continue
        assert ended == 1, child.said
        assert "FIL004" in child.said
        assert os.strerror(code) in child.said
        assert "nothing is written" in child.said
        assert there(folder) == old
        assert stray(job.folder) == []
        failed += 1
    assert failed >= min(most, len(new)), "the disk was asked for less than there are files"
    if most == 100:
        assert ended in (0, 3), child.said
        assert there(folder) == new
        assert stray(job.folder) == []


@pytest.mark.slow
@pytest.mark.parametrize("before", [False, True])
def test_a_disk_that_is_full(shop, before):
    """A real file system with room for more and more pages: whole files of one run, or those of the run before."""
    job, _, old, new, _ = shop
    room = sum(-(-len(content) // PAGE) + 1 for content in new.values()) * PAGE
    outcomes = set()
    for pages in (1, *range(2, 2 * room // PAGE + 8, STEP)):
        disk = job.folder / "disk"
        with a_disk(disk, "size=64m") as remount:
            if before:
                for name, content in old.items():
                    (disk / name).write_bytes(content)
            used = os.statvfs(disk)
            used_pages = (used.f_blocks - used.f_bfree) * used.f_frsize // PAGE
            remount(f"size={(used_pages + pages) * PAGE}")
            child = Child([job.program, NEW, "-o", f"{disk}/", "-q"], job.folder)
            code = child.end()
            outcomes.add(code)
            assert code in (0, 1, 3), child.said
            found = there(disk)
            if code == 1:
                assert "FIL004" in child.said
                assert "No space left" in child.said
                assert found == (old if before else {})
            else:
                assert set(found) == set(new)
                assert found["part.src"] == new["part.src"]
            assert stray(disk) == []
    assert 1 in outcomes
    assert outcomes & {0, 3}


@pytest.mark.slow
def test_a_disk_without_room_for_another_name(shop):
    job, _, _, new, _ = shop
    outcomes = set()
    for names in range(1, 2 * len(new) + 6, 2):
        with a_disk(job.folder / "disk", f"nr_inodes={names}"):
            child = Child([job.program, NEW, "-o", f"{job.folder / 'disk'}/", "-q"], job.folder)
            outcomes.add(child.end())
            assert set(there(job.folder / "disk")) in (set(), set(new))
            assert stray(job.folder) == []
    assert outcomes >= {1}
    assert outcomes & {0, 3}


@pytest.mark.slow
def test_a_disk_that_is_read_only(compensate, shop):
    """Results go elsewhere or nowhere; the program on it is as it was."""
    job, _, _, new, _ = shop
    disk = job.folder / "disk"
    with a_disk(disk, "size=64m") as remount:
        for name in ("part.src", "part.dat", "cell.yaml"):
            shutil.copyfile(job.folder / name, disk / name)
        before = there(disk)
        remount("ro")
        program = disk / "part.src"
        refused(Child([program, NEW], disk))
        refused(Child([program, NEW, "--json", disk / "a.json", "-o", job.folder / "other"], disk))
        done = compensate("batch", disk, NEW, "-j", "1")
        assert (done.code, "FIL004" in done.out + done.err) == (1, True)
        assert there(disk) == before
        assert list(disk.glob("compensated")) == []
        child = Child([program, NEW, "-o", job.folder / "other", "-q"], disk)
        assert child.end() in (0, 3), child.said
        assert there(job.folder / "other").keys() == new.keys()


@pytest.mark.sample(1)
@pytest.mark.parametrize("which", ["beside", "results"])
def test_a_folder_that_nobody_may_write(compensate, job, which):
    """The program's folder, in which there is no folder of results yet, or the folder of results itself."""
    assert (
        compensate(job.program, "--force", "--dry-run").code == 0
    )  # modules are there before rights are given up
    folder = job.folder if which == "beside" else job.output.parent
    folder.mkdir(exist_ok=True)
    for path in (job.folder, *job.folder.parents):
        if path.stat().st_uid == os.geteuid() and len(path.parts) > 2:
            path.chmod(path.stat().st_mode | 0o055)
    folder.chmod(0o555)
    before = set(job.folder.rglob("*"))

    def nobody() -> None:
        if os.geteuid() == 0:  # who may write anywhere
            os.seteuid(65534)

    refused(Child([job.program, "--force"], Path(job.folder), once(1, nobody)))
    assert set(job.folder.rglob("*")) == before
    folder.chmod(0o755)
