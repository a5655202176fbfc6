"""Every result that a test makes is held against the schema that ``compensate schema`` prints: in this process as it is
made, of other processes what they print and what they write into the folder of the test.

It is imported before anything that imports ``complete_result``, which all results pass through.
"""

from __future__ import annotations

import json
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache, wraps
from pathlib import Path

from postproc.report import result_keys

complete_result = result_keys.complete_result
"""The function itself, unchecked."""


@wraps(complete_result)
def checked(command, result):
    """An AssertionError where the result is not valid: no command takes it for an error of its own."""
    whole = complete_result(command, result)
    faults = faults_of(json.loads(json.dumps(whole)))
    assert not faults, f"a result of {command} is not what its schema says: {'; '.join(faults)}"
    return whole


MOST_FILES = 50
"""JSON files of a test that are looked at."""


@contextmanager
def printed_results() -> Iterator[list[str | bytes]]:
    """What processes print that ``subprocess.run`` starts meanwhile."""
    printed, real = [], subprocess.run

    def run(*words, **options):
        done = real(*words, **options)
        if done.returncode in (0, 1, 3) and done.stdout:
            printed.append(done.stdout)
        return done

    subprocess.run = run
    try:
        yield printed
    finally:
        subprocess.run = real


def faults_of_text(text: str | bytes) -> list[str]:
    """Of a result, or of lines that are results; nothing of any other text."""
    text = text.decode("utf-8", "replace") if isinstance(text, bytes) else text
    if '"schema_version"' not in text or text[0] != "{":
        return []
    for parts in ([text], text.splitlines()):
        try:
            results = [json.loads(part) for part in parts]
        except json.JSONDecodeError:
            continue
        return [fault for one in results if _is_result(one) for fault in faults_of(one)]
    return []


def faults_of_file(path: Path) -> list[str]:
    try:
        return faults_of_text(path.read_bytes()) if path.stat().st_size else []
    except OSError:
        return []


def _is_result(value: object) -> bool:
    return isinstance(value, dict) and "schema_version" in value and value.get("command") in _validators()


def faults_of(result):
    """What of a result its schema does not take, in words."""
    validator = _validators()[result["command"]]
    try:
        errors = list(validator.iter_errors(result))
    except UnicodeEncodeError:  # a file name that is no text
        text = json.dumps(result, ensure_ascii=False).encode("utf-8", "replace")
        errors = list(validator.iter_errors(json.loads(text)))
    return [f"{'.'.join(map(str, error.instance_path))}: {error.message[:300]}" for error in errors]


@cache
def _validators():
    """Command as results name it -> validator."""
    import jsonschema_rs

    from postproc.schemas import RESULT_SCHEMAS, schema_of

    schemas = [schema_of(name) for name in RESULT_SCHEMAS if name != "corrections"]
    return {
        schema["anyOf"][0]["properties"]["command"]["const"]: jsonschema_rs.Draft202012Validator(schema)
        for schema in schemas
    }


result_keys.complete_result = checked
