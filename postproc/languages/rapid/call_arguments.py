"""What a routine gets from a call, and what it gives back."""

from __future__ import annotations

from collections.abc import Iterator, Set

from postproc.languages.rapid.evaluation import Evaluator
from postproc.languages.rapid.program_state import ProgramState
from postproc.languages.rapid.syntax_tree import Argument, Instruction, Name, RapidRoutine, presence_name
from postproc.languages.rapid.values import FALSE, TRUE, UnknownData, Value, plain

Shared = list[tuple[bytes, Argument]]
"""Parameters that are data of the caller, with their arguments."""


def give_arguments(
    routine: RapidRoutine, step: Instruction, evaluator: Evaluator, state: ProgramState
) -> Shared:
    """Puts the arguments into the state in which the routine starts: optional ones by name, others in order."""
    required = [argument for argument in step.arguments if not argument.name]
    named = {argument.name: argument for argument in step.arguments if argument.name}
    shared: Shared = []
    for parameter in routine.parameters:
        argument = named.get(parameter.name)
        if not parameter.optional and required:
            argument = required.pop(0)
        key = routine.name + b"/" + parameter.name
        value: Value = UnknownData(f"{parameter.name.decode('latin-1')} is not given")
        if argument is not None and argument.value is not None:
            value = plain(evaluator.value(argument.value))
        state.put(key, value)
        if parameter.optional:
            there = FALSE if argument is None else TRUE
            state.put(routine.name + b"/" + presence_name(parameter.name), there)
        if parameter.mode and argument is not None:
            shared.append((parameter.name, argument))
    return shared


def given_back(
    routine: RapidRoutine, shared: Shared, changed: Set[bytes], after: ProgramState
) -> Iterator[tuple[bytes, Value]]:
    """Variables of the caller that the routine has changed by its parameters, with their values ``after`` it."""
    for parameter, argument in shared:
        value = after.values.get(routine.name + b"/" + parameter)
        if parameter in changed and value is not None and isinstance(argument.value, Name):
            yield argument.value.name, plain(value)
