"""Parser for the syntax lines of commands, from which the studio makes forms.

A syntax line has keywords in capitals, ``<values>``, ``<A/B>`` for a choice, ``"<texts>"``, ``[optional parts]``, ``…``
after what may be repeated, and `` or `` between ways to call the command. What it does not say about a user's command
(whether a value is a number or a name) is checked when the line runs.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass

__all__ = ["Choice", "Field", "Option", "TextField", "Way", "line_of", "ways_of"]

_TOKEN = re.compile(r'"<[^>]*>[^"\s]*"|<[^>]*>|\[|\]|…|[^\s\[\]<>"…]+')
_WAYS = re.compile(r",? or (?=[A-Z_0-9]+ )|, (?=[A-Z_0-9]+ [<\"A-Z])")
_NUMBER = re.compile(
    r"\b(key\d?|other key|frames?|step|degrees|metres|m|factor|pascals|newtons|percent|ratio|coefficient|x|y|z|radius"
    r"|share|vertices|value|number|smallest|largest|start|stop|first|last|tension|continuity|bias|width|height|exponent"
    r"|kg/m³|placements|shear|second joint|third joint|from|to|amount|angle)\b"
)


@dataclass(frozen=True)
class TextField:
    """A value to be typed.

    Attributes:
        label: Its label.
        quoted: Whether it is a quoted text: a file name, a message.
        number: Whether it is probably a number.
        suffixes: Allowed suffixes, if it is the name of an output file.
        repeated: Whether several values, separated by blanks, are allowed.
    """

    label: str
    quoted: bool = False
    number: bool = False
    suffixes: tuple[str, ...] = ()
    repeated: bool = False


@dataclass(frozen=True)
class Choice:
    """A choice of one keyword, or of several if ``repeated``; may be empty if ``optional``."""

    label: str
    options: tuple[str, ...]
    optional: bool = False
    repeated: bool = False


@dataclass(frozen=True)
class Option:
    """An optional part: its keyword, if it has one, and the fields after it."""

    keyword: str
    fields: tuple[Field, ...]


@dataclass(frozen=True)
class Keyword:
    """A fixed word."""

    word: str


Field = TextField | Choice | Option | Keyword


@dataclass(frozen=True)
class Way:
    """One way to call a command: its fields in order."""

    fields: tuple[Field, ...]

    @property
    def title(self) -> str:
        """Title that distinguishes it from the other ways."""
        words = []
        for field in self.fields:
            match field:
                case Keyword(word):
                    words.append(word)
                case Choice(_, options, False, _):
                    words.append("/".join(options[:3]))
                case TextField(label, _, _, _, _):
                    words.append(f"<{label}>")
                case Option(keyword, _):
                    if keyword:
                        words.append(f"[{keyword}]")
        return " ".join(words[:6]) or "plain"


def ways_of(name: str, syntax: str) -> tuple[Way, ...]:
    """The ways to call a command, parsed from its syntax line."""
    text = re.sub(r"\bthen \[", "[", syntax.replace(", then [", " ["))
    parts = _split(text)
    ways = []
    for part in parts:
        body = part.strip().removeprefix(name).strip()
        fields, _ = _fields(_TOKEN.findall(body), 0)
        ways.append(Way(tuple(fields)))
    if len(ways) > 1 and syntax != text:  # the part after "then" belongs to every way
        tail = tuple(field for field in ways[-1].fields if isinstance(field, Option))
        ways = [Way((*(f for f in way.fields if f not in tail), *tail)) for way in ways]
    return tuple(ways)


def _split(text: str) -> list[str]:
    """Split into the ways to call it, outside brackets and quotes."""
    parts, last = [], 0
    for match in _WAYS.finditer(text):
        before = text[: match.start()]
        if before.count("[") == before.count("]") and before.count("<") == before.count(">"):
            parts.append(text[last : match.start()])
            last = match.end()
    return [*parts, text[last:]]


def _fields(tokens: list[str], k: int) -> tuple[list[Field], int]:
    fields: list[Field] = []
    while k < len(tokens):
        token = tokens[k]
        k += 1
        if token == "]":
            break
        if token.startswith("/"):  # an alternative with options of its own has no field; it can be typed
            while k < len(tokens) and tokens[k] != "]":
                k = _fields(tokens, k + 1)[1] if tokens[k] == "[" else k + 1
            continue
        if token == "[":
            inner, k = _fields(tokens, k)
            fields.append(_option(inner))
        elif token == "…":
            fields = _repeated(fields)
        elif token == ",":
            continue
        else:
            fields.append(_field(token.rstrip(",")))
    return fields, k


def _field(token: str) -> Field:
    if token.startswith('"'):
        inside, _, after = token.strip('"').removeprefix("<").partition(">")
        return TextField(inside, quoted=True, suffixes=tuple(part for part in after.split("/") if part.startswith(".")))
    if token.startswith("<"):
        inside = token.strip("<>")
        options = inside.split("/")
        if len(options) > 1 and all(re.fullmatch(r"[A-Z][A-Z0-9_\-]*", option) for option in options):
            return Choice(_called(options), tuple(options))
        return TextField(inside, number=bool(_NUMBER.search(inside)) and " or " not in inside)
    options = token.split("/")
    if len(options) > 1 and all(options):
        return Choice(_called(options), tuple(options))
    return Keyword(token)


def _called(options: list[str]) -> str:
    """Label of a choice between keywords."""
    names = {"LEFT": "side", "THUMB": "digit", "FLEXION": "angle", "KNUCKLES2": "joint", "X": "axis"}
    return names.get(options[0], "which" if len("/".join(options)) > 24 else " or ".join(options).lower())


def _option(inner: list[Field]) -> Field:
    match inner:
        case [Keyword(word), *rest]:
            return Option(word, tuple(rest))
        case [Choice(label, options, _, repeated)]:
            return Choice(label, options, optional=True, repeated=repeated)
        case _:
            return Option("", tuple(inner))


def _repeated(fields: list[Field]) -> list[Field]:
    match fields:
        case [*before, TextField(label, quoted, number, suffixes, _)]:
            return [*before, TextField(label, quoted, number, suffixes, repeated=True)]
        case [*before, Choice(label, options, optional, _)]:
            return [*before, Choice(label, options, optional, repeated=True)]
        case _:
            return fields


def line_of(name: str, way: Way, values: Mapping[tuple[int, ...], object]) -> str:
    """Script line from the values of a form.

    Args:
        name: The command.
        way: The way to call it.
        values: Values by field index; fields inside an optional part by both indices. Texts and numbers as they are,
            for choices the keyword or "", for optional parts whether they are present.
    """
    return " ".join([name, *_words(way.fields, (), values)])


def _words(fields: tuple[Field, ...], place: tuple[int, ...], values: Mapping[tuple[int, ...], object]) -> list[str]:
    words: list[str] = []
    for k, field in enumerate(fields):
        here = (*place, k)
        match field:
            case Keyword(word):
                words.append(word)
            case Option(keyword, inner):
                if values.get(here):
                    words += [keyword] if keyword else []
                    words += _words(inner, here, values)
            case Choice():
                words += [str(values[here])] if values.get(here) else []
            case TextField(_, quoted, _, _, _):
                value = values.get(here, "")
                text = f"{value:.10g}" if isinstance(value, float | int) else str(value).strip()
                words += [f'"{text}"'] if quoted else [text] if text else []
    return words
