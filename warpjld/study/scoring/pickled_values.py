"""Safe reading of pickles: arrays, numbers, texts, lists and dictionaries, without executing the pickle.

NumPy stores a dictionary in an ``.npy`` file as a pickle, and unpickling executes whatever the file says. Here Python's
unpickler is not used: the standard library's `pickletools` splits the bytes into opcodes, and this module interprets
those that create plain values. Names that a pickle would call are compared with a short list of NumPy's names, and the
result of such a call is created here from the bytes; nothing is imported or called by a name from the file. A
restricted unpickler would be shorter, but would still call NumPy's constructors with arguments chosen by the file.
"""

from __future__ import annotations

import pickletools
import re
from dataclasses import dataclass, field
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from warpjld.errors import InputError
from warpjld.files.input_file import read_bytes
from warpjld.files.reading import reading

__all__ = ["read_object_array", "values_of_pickle"]

_KINDS = re.compile(r"[<>|=]?(b1|[iu][1248]|f[248]|U\d{1,6}|S\d{1,6}|O8?|[?])")
_CORE = ("numpy.core", "numpy._core")
_ARRAY = {f"{core}.multiarray._reconstruct" for core in _CORE}
_SCALAR = {f"{core}.multiarray.scalar" for core in _CORE}
_BUFFER = {f"{core}.numeric._frombuffer" for core in _CORE}
_CLASSES = {"numpy.ndarray", "numpy.dtype", "numpy.float64", "numpy.float32", "numpy.int64", "numpy.int32"}
_KNOWN = {*_ARRAY, *_SCALAR, *_BUFFER, *_CLASSES, "_codecs.encode", "__builtin__.bytes", "collections.OrderedDict"}

_CONSTANTS = {"NONE": None, "NEWTRUE": True, "NEWFALSE": False}
_EMPTY = {"EMPTY_DICT": dict, "EMPTY_LIST": list, "EMPTY_TUPLE": tuple}
_TUPLES = {"TUPLE1": 1, "TUPLE2": 2, "TUPLE3": 3}
_LITERALS = {"BININT", "BININT1", "BININT2", "LONG1", "LONG4", "INT", "LONG", "FLOAT", "BINFLOAT", "UNICODE",
             "BINUNICODE", "SHORT_BINUNICODE", "BINUNICODE8", "BINBYTES", "SHORT_BINBYTES", "BINBYTES8", "BYTEARRAY8",
             "BINSTRING", "SHORT_BINSTRING", "STRING"}  # fmt: skip
_PUTS, _GETS = {"BINPUT", "LONG_BINPUT", "PUT"}, {"BINGET", "LONG_BINGET", "GET"}
_NOTHING = {"PROTO", "FRAME", "STOP"}


@dataclass(frozen=True)
class _Name:
    """A Python name in a pickle."""

    text: str


@dataclass
class _Type:
    """A NumPy dtype under construction."""

    text: str
    order: str = ""

    def numpy(self) -> np.dtype[Any]:
        return np.dtype(self.order + self.text.lstrip("<>|=") if self.order in ("<", ">") else self.text)


@dataclass
class _Array:
    """A NumPy array under construction: its numbers, or the list of an array of objects."""

    value: Any = None


_MARK = object()


@dataclass
class _Machine:
    """Interpreter of pickle opcodes, with the stack and the memo."""

    stack: list[Any] = field(default_factory=list)
    memory: dict[int, Any] = field(default_factory=dict)

    def do(self, code: str, argument: Any) -> None:
        """Execute one opcode.

        Raises:
            InputError: An opcode that plain values do not need.
        """
        stack = self.stack
        if code in _NOTHING:
            return
        if code in _LITERALS:
            stack.append(bytes(argument) if isinstance(argument, bytearray) else argument)
        elif code in _CONSTANTS:
            stack.append(_CONSTANTS[code])
        elif code in _EMPTY:
            stack.append(_EMPTY[code]())
        elif code == "MARK":
            stack.append(_MARK)
        elif code in _TUPLES:
            stack.append(self._pop(_TUPLES[code]))
        elif code == "MEMOIZE":
            self.memory[len(self.memory)] = stack[-1]
        elif code in _PUTS:
            self.memory[int(argument)] = stack[-1]
        elif code in _GETS:
            stack.append(self.memory[int(argument)])
        else:
            self._build(code, argument)

    def _build(self, code: str, argument: Any) -> None:
        stack = self.stack
        match code:
            case "TUPLE" | "LIST":
                made = self._to_mark()
                stack.append(tuple(made) if code == "TUPLE" else made)
            case "DICT":
                stack.append(_pairs(self._to_mark()))
            case "APPEND" | "APPENDS":
                added = [stack.pop()] if code == "APPEND" else self._to_mark()
                _of(stack[-1], list).extend(added)
            case "SETITEM" | "SETITEMS":
                pairs = list(self._pop(2)) if code == "SETITEM" else self._to_mark()
                _of(stack[-1], dict).update(_pairs(pairs))
            case "GLOBAL":
                stack.append(_name(argument.replace(" ", ".")))
            case "STACK_GLOBAL":
                module, name = self._pop(2)
                stack.append(_name(f"{module}.{name}"))
            case "REDUCE":
                name, arguments = self._pop(2)
                stack.append(_made(_of(name, _Name).text, _of(arguments, tuple)))
            case "BUILD":
                state = _of(stack.pop(), tuple)
                _set_state(stack[-1], state)
            case _:
                raise InputError(f"pickled with {code}, which plain values do not need")

    def _pop(self, count: int) -> tuple[Any, ...]:
        if len(self.stack) < count:
            raise InputError("the pickle takes more than it holds")
        taken = tuple(self.stack[-count:])
        del self.stack[-count:]
        return taken

    def _to_mark(self) -> list[Any]:
        place = next((k for k in range(len(self.stack) - 1, -1, -1) if self.stack[k] is _MARK), None)
        if place is None:
            raise InputError("the pickle takes more than it holds")
        taken = self.stack[place + 1 :]
        del self.stack[place:]
        return taken


def read_object_array(path: str | Path) -> Any:
    """Content of an ``.npy`` file: an array, or the plain values in an array of Python objects (see below).

    Raises:
        InputError: Not such a file, or content other than arrays, numbers, texts, lists and dictionaries.
    """
    data = BytesIO(read_bytes(path))
    with reading(path, "a NumPy file (.npy)"):
        version = np.lib.format.read_magic(data)
        read = np.lib.format.read_array_header_1_0 if version == (1, 0) else np.lib.format.read_array_header_2_0
        kind = read(data)[2]
        if not kind.hasobject:
            data.seek(0)
            return np.lib.format.read_array(data, allow_pickle=False)
        return values_of_pickle(data.read())


def values_of_pickle(data: bytes) -> Any:
    """Plain values in a pickle; an array with a single object is returned as that object.

    Raises:
        InputError: It contains something else, or is damaged.
    """
    machine = _Machine()
    for code, argument, _ in pickletools.genops(data):
        machine.do(code.name, argument)
    if len(machine.stack) != 1:
        raise InputError("the pickle does not end with one value")
    return _plain(machine.stack[0], {})


def _name(text: str) -> _Name:
    if text not in _KNOWN:
        raise InputError(
            f"asks for '{text[:80]}' to be run: not done; only arrays, numbers, texts, lists and dictionaries are read"
        )
    return _Name(text)


def _made(name: str, arguments: tuple[Any, ...]) -> Any:
    """Result of a call in the pickle, created without calling it."""
    if name in _ARRAY:
        return _Array()
    if name == "numpy.dtype":
        return _Type(_checked_kind(arguments[0]))
    if name in _SCALAR:
        return np.frombuffer(_of(arguments[1], bytes), dtype=_of(arguments[0], _Type).numpy())[0].item()
    if name in _BUFFER:
        raw, kind, shape, order = arguments
        return _Array(_array(_of(raw, bytes), _of(kind, _Type), shape, order == "F"))
    if name == "_codecs.encode" and arguments[1:] == ("latin1",):
        return _of(arguments[0], str).encode("latin1")
    if name == "collections.OrderedDict" and not arguments:
        return {}
    if name == "__builtin__.bytes" and not arguments:
        return b""
    raise InputError(f"the pickle calls {name} as no array or number is made")


def _set_state(made: Any, state: tuple[Any, ...]) -> None:
    if isinstance(made, _Type):
        if any(part is not None for part in state[2:5]):
            raise InputError("arrays of records are not read")
        made.order = _of(state[1], str)
        return
    _, shape, kind, fortran, content = state
    if isinstance(content, list):
        _of(made, _Array).value = content[0] if shape == () and len(content) == 1 else content
    else:
        _of(made, _Array).value = _array(_of(content, bytes), _of(kind, _Type), shape, bool(fortran))


def _array(raw: bytes, kind: _Type, shape: Any, fortran: bool) -> NDArray[Any]:
    flat = np.frombuffer(raw, dtype=kind.numpy())
    return flat.reshape(shape, order="F" if fortran else "C").copy()


def _checked_kind(text: Any) -> str:
    if not isinstance(text, str) or not _KINDS.fullmatch(text):
        raise InputError(f"arrays of {text!r} are not read")
    return text


def _pairs(flat: list[Any]) -> dict[Any, Any]:
    if len(flat) % 2 or not all(isinstance(key, str | int | float) for key in flat[::2]):
        raise InputError("a dictionary's keys are no texts or numbers")
    return dict(zip(flat[::2], flat[1::2], strict=True))


def _of(value: Any, kind: type) -> Any:
    if not isinstance(value, kind):
        raise InputError("the pickle is damaged, or makes something else than arrays, numbers, texts, lists")
    return value


def _plain(value: Any, seen: dict[int, Any]) -> Any:
    """The value with arrays under construction replaced by finished ones; shared values are visited once."""
    if isinstance(value, _Array):
        return _plain(value.value, seen)
    if isinstance(value, _Name | _Type) or value is _MARK:
        raise InputError("holds something else than arrays, numbers, texts, lists and dictionaries")
    if not isinstance(value, list | tuple | dict):
        return value
    if id(value) not in seen:
        made: Any = {} if isinstance(value, dict) else []
        seen[id(value)] = made
        if isinstance(value, dict):
            made.update((key, _plain(item, seen)) for key, item in value.items())
        else:
            made.extend(_plain(item, seen) for item in value)
    return seen[id(value)]
