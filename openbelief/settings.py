"""Settings that pydantic checks when they are made; what is wrong is said in one line that names the setting."""

from __future__ import annotations

import functools
import sys
from collections.abc import Callable
from typing import Annotated, Any, TypeVar

from pydantic import BeforeValidator, ConfigDict, Field, Strict, ValidationError

Settings = TypeVar("Settings")


def _plain(value: Any) -> Any:
    """numpy's scalars as Python's, so that one value has one hash."""
    return value.item() if getattr(value, "shape", None) == () else value


def _number(value: Any) -> Any:
    """Whole numbers are numbers; what no float can hold is not finite."""
    value = _plain(value)
    return float("inf") if type(value) is int and abs(value) > sys.float_info.max else value


CHECKED = ConfigDict(allow_inf_nan=False, extra="forbid")
Number = Annotated[float, Strict(), BeforeValidator(_number)]
Whole = Annotated[int, Strict(), BeforeValidator(_plain)]
Flag = Annotated[bool, Strict(), BeforeValidator(_plain)]
Positive = Annotated[Number, Field(gt=0)]
Fraction = Annotated[Number, Field(ge=0, le=1)]
Cosine = Annotated[Number, Field(ge=-1, le=1)]

# What pydantic found -> our words; {...} is of its context.
COMPLAINTS = {
    "float_type": "should be a number",
    "int_type": "should be a whole number",
    "bool_type": "should be true or false",
    "string_type": "should be text",
    "literal_error": "should be one of {expected}",
    "finite_number": "must be finite",
    "greater_than": "must be greater than {gt:g}",
    "greater_than_equal": "must be at least {ge:g}",
    "less_than_equal": "must be at most {le:g}",
}
UNKNOWN = ("unexpected_keyword_argument", "extra_forbidden")


def first_complaint(error: ValidationError, whole: str = "") -> str:
    """ "WHERE: what is wrong there" of the first thing that pydantic found. whole: the name of all of it."""
    first = error.errors(include_url=False, include_input=False)[0]
    where = ".".join(str(part) for part in first["loc"]) or whole
    what = "unknown key" if first["type"] in UNKNOWN else first["msg"].removeprefix("Value error, ")
    return f"{where}: {what}" if where else what


def in_one_line(noun: str) -> Callable[[type[Settings]], type[Settings]]:
    """Class decorator over a pydantic dataclass: ValueError "NOUN NAME should be ..., got ..." for a refused value."""

    def decorate(cls: type[Settings]) -> type[Settings]:
        validate = cls.__init__

        @functools.wraps(validate)
        def init(self: Settings, *args: Any, **values: Any) -> None:
            try:
                validate(self, *args, **values)
            except ValidationError as error:
                raise ValueError(_complaint(cls, noun, error)) from error

        cls.__init__ = init  # type: ignore[assignment, method-assign]
        return cls

    return decorate


def _complaint(cls: type, noun: str, error: ValidationError) -> str:
    first = error.errors(include_url=False)[0]
    kind, name = first["type"], ".".join(str(part) for part in first["loc"])
    if kind in UNKNOWN:
        known = ", ".join(sorted(cls.__dataclass_fields__))  # type: ignore[attr-defined]
        return f"Unknown {noun[0].lower()}{noun[1:]} {name!r}; known are {known}."
    if kind == "value_error":
        return f"{noun} {name}: {first['ctx']['error']}" if name else str(first["ctx"]["error"])
    said = COMPLAINTS.get(kind)
    words = said.format(**first.get("ctx", {})) if said else first["msg"]
    return f"{noun} {name} {words}, got {first['input']!r:.80}."
