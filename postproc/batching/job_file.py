"""What a batch is to do: a job file, a folder or patterns, as checked jobs.

All that can be known to be wrong before the first program is read is reported here, and then nothing has started.
"""

from __future__ import annotations

import os
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import yaml

from postproc.base.findings import Finding, Refusal, nearest
from postproc.base.system import FileSet, relative_path
from postproc.base.yaml_section import YamlSection, parsed, read
from postproc.batching.programs import find_programs, is_inside
from postproc.process.stated_forces import FORM, NotAForce, parse_force
from postproc.robot.description import find_robot
from postproc.workflows.option_names import FORMER_OPTIONS, FORMER_VALUES, SHARED_POINTS, present_value
from postproc.workflows.preparation import Request

JOB_FILE = (".yaml", ".yml")
FOLDER = "compensated"
"""Where results go that no ``output`` names, below the folder of the batch."""

OptionValues = Mapping[str, object]
"""Options that are set: names and values of fields of a Request."""


@dataclass(frozen=True)
class Job:
    """One program to compensate.

    ``name``: its path in the folder of the batch; ``target``: the compensated program.  Paths are absolute, because
    a worker of a cluster has another working folder.
    """

    name: str
    target: Path
    request: Request


@dataclass(frozen=True)
class Jobs:
    """A checked batch.  ``root``: the folder of its results; ``passed_over``: files that matched and are no program."""

    root: Path
    jobs: tuple[Job, ...]
    passed_over: tuple[Path, ...] = ()


def jobs_of(
    words: Sequence[str], command_options: OptionValues, output: Path | None = None, outside: bool = False
) -> Jobs:
    """The jobs of the words of a command line: one job file; or folders, files and patterns.

    ``command_options`` and ``output`` come from the command line too and win over the job file.  ``outside``: the job
    file may name programs and outputs beyond its folder.  Raises Refusal: YML... for the job file, BAT001 (nothing
    matched), BAT002 (two programs, one output), BAT003 (outside, also by a link), FIL007, CEL003, FRC002.
    """
    files = [word for word in words if word.lower().endswith(JOB_FILE)]
    if files and len(words) > 1:
        raise Refusal(
            Finding(
                "BAT001", "a job file must be the only argument", files[0], help="give one job file per batch"
            )
        )
    if files:
        return _of_file(Path(os.path.abspath(files[0])), command_options, output, outside)
    matches = [find_programs(word, Path.cwd()) for word in words]
    for word, one in zip(words, matches, strict=True):
        if not one.programs:
            raise Refusal(one.nothing(word))
    try:
        base = Path(os.path.commonpath([one.anchor for one in matches]))
    except ValueError:
        message = "the programs are on different drives, which have no folder in common for the results"
        raise Refusal(
            Finding("BAT001", message, help="start a batch for each drive, or write a job file")
        ) from None
    root = base / FOLDER if output is None else Path(os.path.abspath(output))
    if output is None and not is_inside(root, base):
        raise Refusal(Finding("BAT003", f"{root} leads out of {base}", help=RESULTS_ARE_LINK))
    programs = _not_below(root, base, [path for one in matches for path in one.programs])
    if not programs:
        raise Refusal(Finding("BAT001", "the folder contains only results of an earlier run", str(root)))
    jobs = tuple(_job(program, base, root, command_options, None) for program in programs)
    _check(jobs)
    return Jobs(root, jobs, tuple(path for one in matches for path in one.passed_over))


def options_of_words(**words: object) -> OptionValues:
    """The options that a command line states, as a Request has them: files are absolute, what is not stated is not
    there."""
    options: dict[str, object] = {}
    for key, value in words.items():
        if value is None or value is False:
            continue
        if key in ("cell", "config_dat"):
            value = Path(os.path.abspath(str(value)))
        is_file = isinstance(value, str) and value.lower().endswith((".csv", *JOB_FILE))
        options[key] = os.path.abspath(str(value)) if key in ("force", "robot") and is_file else value
    return options


def refuse_unusable(options: OptionValues) -> None:
    """Raises Refusal for options, as of ``options_of_words``, that no program could be compensated with: FRC002 for a
    force, FIL001 for a file that is not there, CEL003 for a robot."""
    force, robot = str(options.get("force") or "").strip(), options.get("robot")
    files = [options.get(key) for key in ("cell", "config_dat")]
    if force.lower().endswith((".csv", *JOB_FILE)):
        files.append(force)
    elif force:
        try:
            parse_force(force)
        except NotAForce as error:
            raise Refusal(
                Finding("FRC002", f"--force {force} is not a force: {error}", help=f"write {FORM}")
            ) from None
    for file in files:
        if file is not None and not os.path.isfile(str(file)):
            raise Refusal(Finding("FIL001", "the file does not exist", str(file)))
    if robot is not None:
        find_robot(str(robot), None)


def _of_file(path: Path, command_options: OptionValues, output: Path | None, outside: bool) -> Jobs:
    top = _loaded(path)
    top.only(*JOB_KEYS, *_former_in(top))
    base = path.parent
    root = (
        Path(os.path.abspath(output))
        if output
        else base / (_word(top, "output") if "output" in top else FOLDER)
    )
    root = Path(os.path.abspath(root))
    if not (output or outside or is_inside(root, base)):
        raise _outside(top, "output", root, base)
    general = _options(top)
    matches, programs = [], {}
    for word, place in _words(top, "programs"):
        one = find_programs(word, base)
        for program in one.programs:
            if not (outside or is_inside(program, base)):
                raise Refusal(place("BAT003", f"{program} is outside of {base}", OUTSIDE))
        if not one.programs:
            if not (outside or is_inside(one.anchor, base)):
                raise Refusal(place("BAT003", f"{one.anchor} is outside of {base}", OUTSIDE))
            missing = one.nothing(word)
            raise Refusal(place(missing.code, missing.message, missing.help))
        matches.append(one)
        programs.update(dict.fromkeys(one.programs))
    for word, _ in _words(top, "exclude") if "exclude" in top else ():
        for program in find_programs(word, base).programs:
            programs.pop(program, None)
    selected = _not_below(root, base, list(programs))
    if not selected:
        raise top.error("BAT001", "no program remains: all matches are excluded, or are results", "programs")
    special = _overrides(top, base, selected)
    jobs = []
    for program in selected:
        own: dict[str, object] = {}
        for options in special.get(program, ()):
            own.update(options)
        where = own.pop("output", None)
        job = _job(
            program, base, root, {**general, **own, **command_options}, None if where is None else str(where)
        )
        if where is not None and not (outside or is_inside(job.target, base) or is_inside(job.target, root)):
            raise _outside(top, "overrides", job.target, base)
        jobs.append(job)
    _check(jobs, str(path))
    return Jobs(root, tuple(jobs), tuple(path for one in matches for path in one.passed_over))


RESULTS_ARE_LINK = "the folder of the results is a symbolic link; remove it, or name its target as the output"

OUTSIDE = "programs and outputs of a job file must be in its folder or below; --allow-outside permits others"


def _outside(section: YamlSection, key: str, path: Path, base: Path) -> Refusal:
    return section.error("BAT003", f"{path} is outside of {base}", key, OUTSIDE)


def _loaded(path: Path) -> YamlSection:
    raw = read(path)
    try:
        return parsed(raw, path)
    except Refusal as refusal:
        first = refusal.findings[0]
        lines = raw.decode("utf-8", "replace").splitlines()
        if first.code == "YML001" and 0 < first.line <= len(lines) and _STAR.search(lines[first.line - 1]):
            refusal = Refusal(replace(first, help='write a pattern that starts with * in quotes: "*.src"'))
        raise refusal from None


_STAR = re.compile(r"(?:^|[\s\[{,])\*")


def _overrides(top: YamlSection, base: Path, programs: Sequence[Path]) -> dict[Path, list[OptionValues]]:
    """What ``overrides:`` states of each program, in the order of the file: a later one wins."""
    parent = top.section("overrides", None)
    special: dict[Path, list[OptionValues]] = {}
    for pattern in parent:
        section = parent.section(pattern)
        section.only("output", *PROGRAM_KEYS, *_former_in(section))
        options = dict(_options(section))
        if "output" in section:
            options["output"] = _word(section, "output")
        hit = set(find_programs(pattern, base).programs) & set(programs)
        if not hit:
            names = [relative_path(program, base) for program in programs]
            raise parent.error(
                "BAT001", f"matches no program of this batch{nearest(pattern, names)}", pattern
            )
        for program in hit:
            special.setdefault(program, []).append(options)
    return special


def _not_below(root: Path, base: Path, programs: Sequence[Path]) -> list[Path]:
    """The programs that are no results of this batch, each once."""
    results = root != base and is_inside(root, base)
    return [path for path in dict.fromkeys(programs) if not (results and path.is_relative_to(root))]


def _job(program: Path, base: Path, root: Path, options: OptionValues, where: str | None) -> Job:
    """``where``: a file, or a folder (no suffix, or a slash at its end), below ``root``; without it the program lies
    there as it does below ``base``."""
    name = Path(relative_path(program, base))
    target = root / (program.name if ".." in name.parts or name.is_absolute() else name)
    if where is None and not is_inside(target.parent, root):
        raise Refusal(Finding("BAT003", f"{target.parent} leads out of {root}", help=RESULTS_ARE_LINK))
    if where is not None:
        target = Path(os.path.abspath(root / where))
        if where.endswith(("/", "\\")) or os.path.isdir(target) or (program.suffix and not target.suffix):
            target /= program.name
    request = Request(program=program, output=target, **options)  # type: ignore[arg-type]
    return Job(name.as_posix(), target, request)


def _check(jobs: Sequence[Job], file: str = "") -> None:
    """Refuse outputs that meet each other (BAT002) or a program of the batch (FIL007)."""
    programs = FileSet(job.request.program for job in jobs)
    taken: dict[tuple[str, str], Job] = {}
    findings = []
    for job in jobs:
        if job.target in programs:
            findings.append(
                Finding("FIL007", f"{job.name}: its output {job.target} is a program of this batch", file)
            )
        # Reports and companions carry the stem; a controller's file system does not distinguish a from A.
        key = (os.path.realpath(job.target.parent), job.target.stem.casefold())
        first = taken.setdefault(key, job)
        if first is not job:
            same = first.target == job.target
            what = (
                f"{job.target}"
                if same
                else f"{first.target} and {job.target}, whose reports have the same name"
            )
            findings.append(
                Finding(
                    "BAT002",
                    f"{first.name} and {job.name} would be written to {what}",
                    file,
                    help="give one of them another `output:` under `overrides:`, or exclude it with `exclude:`",
                )
            )
    if findings:
        raise Refusal(*findings)


# ---------------------------------------------------------------------------------------------- keys of a job file

Place = Callable[[str, str, str], Finding]


def _words(section: YamlSection, key: str) -> Iterator[tuple[str, Place]]:
    """The words under ``key`` (one, or a list of them), each with a maker of findings at its own place."""
    listed = section.is_list(key)
    words = section.texts(key) if listed else [_word(section, key)]
    node = next(value for name, value in section.node.value if name.value == key)
    nodes = node.value if listed else [node]
    if not words:
        raise section.error("YML004", "is an empty list", key)
    for word, at in zip(words, nodes, strict=True):
        place = _place(section, at)
        if not word.strip():
            raise Refusal(place("YML004", f"{key}: a name is empty", ""))
        yield word.strip(), place


def _place(section: YamlSection, node: yaml.Node) -> Place:
    line, column = node.start_mark.line + 1, node.start_mark.column + 1
    return lambda code, message, help: Finding(code, message, str(section.file), line, column, help)


def _word(section: YamlSection, key: str) -> str:
    word = section.text(key).strip()
    if not word:
        raise section.error("YML004", "is empty", key)
    return word


def _options(section: YamlSection) -> OptionValues:
    options = {key: read(section, key) for key, read in PROGRAM_KEYS.items() if key in section}
    for former in _former_in(section):
        key = FORMER_KEYS[former]
        if key in section:
            raise section.error("YML004", f"is the former name of {key!r}, which is given too", former)
        options[key] = PROGRAM_KEYS[key](section, former)
    return options


def _former_in(section: YamlSection) -> list[str]:
    """The keys of a section that are former names."""
    return [former for former in FORMER_KEYS if former in section]


def _file(section: YamlSection, key: str) -> Path:
    path = section.file.parent / _word(section, key)
    if not os.path.isfile(path):
        raise section.error(
            "YML004", f"the file {path} does not exist", key, "paths are relative to the job file"
        )
    return Path(os.path.abspath(path))


def _robot(section: YamlSection, key: str) -> str:
    word = _word(section, key)
    try:
        path = find_robot(word, section.file.parent)
    except Refusal as refusal:
        first = refusal.findings[0]
        raise section.error(first.code, first.message, key, first.help) from None
    return os.path.abspath(path) if word.endswith(JOB_FILE) else word


def _force(section: YamlSection, key: str) -> str | None:
    """``true``: the forces that belong to each program; ``false``: none; else a force or a file, as after --force."""
    word = "" if section.is_list(key) else section.text(key).strip()
    if word in ("true", "false"):
        return "" if section.flag(key, False) else None
    if word.lower().endswith((".csv", *JOB_FILE)):
        return str(_file(section, key))
    try:
        parse_force(word)
    except NotAForce as error:
        help = f"write true (the forces that belong to each program), false, a CSV, or {FORM}"
        raise section.error("FRC002", str(error), key, help) from None
    return word


def _gain(section: YamlSection, key: str) -> float:
    return section.number(key, low=0.0, high=1.0)


def _shared_points(section: YamlSection, key: str) -> str:
    former = section.text(key) in FORMER_VALUES["shared_points"]
    word = section.text(key, choices=() if former else SHARED_POINTS)
    return str(present_value("shared_points", word))


def _flag(section: YamlSection, key: str) -> bool:
    return section.flag(key, False)


PROGRAM_KEYS: dict[str, Callable[[YamlSection, str], object]] = {
    "cell": _file,
    "robot": _robot,
    "force": _force,
    "gain": _gain,
    "config_dat": _file,
    "tare": _flag,
    "no_insert": _flag,
    "shared_points": _shared_points,
    "strict": _flag,
    "allow_compensated": _flag,
}
"""What may be set for all programs and for single ones: key, which is a field of a Request -> its reader."""

FORMER_KEYS = {former: key for former, key in FORMER_OPTIONS.items() if key in PROGRAM_KEYS}
"""Former name of a key -> the key."""

JOB_KEYS = ("programs", "exclude", "output", "overrides", *PROGRAM_KEYS)
