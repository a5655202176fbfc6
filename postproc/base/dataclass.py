"""Frozen dataclasses that are defined in a third of the time.

The decorator of the standard library (before Python 3.13) compiles six functions a class, which made up a seventh of
the time of a small program.  Here a class has an ``__init__`` of its own, and its other methods are not compiled;
``replace``, ``fields``, comparison, hash and pickling are the same.  What is derived from such a class is defined by
this decorator too: that of the standard library refuses it.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from dataclasses import dataclass as dataclass
else:
    from collections.abc import Callable
    from dataclasses import MISSING, Field, FrozenInstanceError, fields
    from dataclasses import dataclass as _dataclass
    from reprlib import recursive_repr
    from typing import Any

    def dataclass(cls: type | None = None, **options: bool) -> Any:
        """As the decorator of the standard library, and made by it where anything else is asked for."""
        eq, shown = options.get("eq", True), options.get("repr", True)
        if not options.get("frozen") or options.keys() - {"frozen", "eq", "repr"}:
            return _dataclass(cls, **options)

        def decorate(cls: type) -> type:
            own = {
                name for name, value in vars(cls).items() if value is not None
            }  # __eq__ alone: no __hash__
            made = _dataclass(init=False, repr=False, eq=False)(cls)
            methods = {"__init__": _init_of(made)}
            if shown:
                methods["__repr__"] = _repr
            if eq:
                methods |= _comparisons_of(made)
            for name, method in methods.items():
                if name not in own:
                    setattr(made, name, method)
            made.__setattr__, made.__delattr__ = _refuse_assignment, _refuse_deletion
            return made

        return decorate

    def _init_of(cls: type) -> Callable[..., None]:
        """``__init__`` with the fields of ``cls`` as its arguments."""
        names: dict[str, object] = {"_MISSING": MISSING}
        arguments, keywords, lines = [], [], ["__fields = self.__dict__"]
        for field in fields(cls):
            name, value = field.name, field.name
            if field.default_factory is not MISSING:
                names[f"_make_{name}"] = field.default_factory
                value = (
                    f"_make_{name}() if {name} is _MISSING else {name}" if field.init else f"_make_{name}()"
                )
            if field.init:
                (keywords if field.kw_only else arguments).append(_argument(field, names))
            if field.init or field.default_factory is not MISSING:
                lines.append(f"__fields[{name!r}] = {value}")
        if hasattr(cls, "__post_init__"):
            lines.append("self.__post_init__()")
        listed = ["self", *arguments, *(["*", *keywords] if keywords else [])]
        exec(f"def __init__({', '.join(listed)}):\n  " + "\n  ".join(lines), names)
        init = names["__init__"]
        init.__qualname__ = f"{cls.__qualname__}.__init__"
        init.__annotations__ = {field.name: field.type for field in fields(cls) if field.init}
        return init

    def _argument(field: Field, names: dict[str, object]) -> str:
        if field.default_factory is not MISSING:
            return f"{field.name}=_MISSING"
        if field.default is MISSING:
            return field.name
        names[f"_default_{field.name}"] = field.default
        return f"{field.name}=_default_{field.name}"

    def _comparisons_of(cls: type) -> dict[str, Callable[..., object]]:
        names = [field.name for field in fields(cls) if field.compare]

        def __eq__(self: object, other: object) -> bool:
            if type(other) is not type(self):
                return NotImplemented
            mine, its = self.__dict__, other.__dict__
            return [mine[name] for name in names] == [its[name] for name in names]

        def __hash__(self: object) -> int:
            mine = self.__dict__
            return hash(tuple([mine[name] for name in names]))

        return {"__eq__": __eq__, "__hash__": __hash__}

    @recursive_repr()
    def _repr(self: object) -> str:
        shown = (f"{field.name}={getattr(self, field.name)!r}" for field in fields(self) if field.repr)
        return f"{type(self).__qualname__}({', '.join(shown)})"

    def _refuse_assignment(self: object, name: str, value: object) -> None:
        raise FrozenInstanceError(f"cannot assign to field {name!r}")

    def _refuse_deletion(self: object, name: str) -> None:
        raise FrozenInstanceError(f"cannot delete field {name!r}")
