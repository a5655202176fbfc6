"""Every result that a test makes in this process is held against the schema that ``compensate schema`` prints.

It is imported before anything that imports ``complete_result``, which all results pass through.
"""

from __future__ import annotations

import json
from functools import cache, wraps

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


def faults_of(result):
    """What of a result its schema does not take, in words."""
    from jsonschema.exceptions import best_match

    error = best_match(_validators()[result["command"]].iter_errors(result))
    return [] if error is None else [f"{error.json_path}: {error.message[:300]}"]


@cache
def _validators():
    """Command as results name it -> validator."""
    from jsonschema import Draft202012Validator

    from postproc.schemas import RESULT_SCHEMAS, schema_of

    schemas = [schema_of(name) for name in RESULT_SCHEMAS if name != "corrections"]
    return {
        schema["anyOf"][0]["properties"]["command"]["const"]: Draft202012Validator(schema)
        for schema in schemas
    }


result_keys.complete_result = checked
