"""Plain functions of numbers and arrays that compiled code can call with numbers; loads no compiler."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from types import ModuleType
from typing import Any, Final, ParamSpec, TypeVar

import numpy as np

P = ParamSpec("P")
R = TypeVar("R")
_MARK: Final = "_both_ways"


def both_ways(function: Callable[P, R]) -> Callable[P, R]:
    """Mark a plain function that compiled code may call too."""
    setattr(function, _MARK, True)
    return function


def chosen(condition: Any, first: Any, second: Any) -> Any:
    """The first where a condition holds, elsewhere the second; in compiled code of numbers."""
    return np.where(condition, first, second)


def called_both_ways(function: Callable[..., Any]) -> Iterator[Callable[..., Any]]:
    """Marked functions that a function may call by name, directly or through other marked ones."""
    todo, seen = [function], {id(function)}
    while todo:
        caller = todo.pop()
        names, namespace = caller.__code__.co_names, caller.__globals__
        modules = [vars(each) for name in names if isinstance(each := namespace.get(name), ModuleType)]
        for each in (space.get(name) for space in (namespace, *modules) for name in names):
            if id(each) not in seen and callable(each) and _MARK in getattr(each, "__dict__", {}):
                seen.add(id(each))
                todo.append(each)
                yield each
