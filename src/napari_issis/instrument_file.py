"""Instruments from TOML files, and what is wrong with a file in one sentence."""

from __future__ import annotations

import os
import tomllib
from collections.abc import Mapping
from dataclasses import MISSING
from difflib import get_close_matches
from typing import Any

import astropy.units as u

from .facts import STATUSES, Fact, Number, numbers
from .filter_set import FILTER_KINDS, NamedFilter
from .instrument import OPEN, Channel, Instrument
from .reading import one_line

LARGEST = 2**20  # bytes
LONGEST_NAME, LONGEST_TEXT = 30, 1000
TEXTS = ("name", "telescope", "default_channel", "psf_note", "filter_note", "limits_note")
TABLES = ("sources", "all_channels", "channels", "filters")
PARTS = ("value", "unit", "status", "source")


def read_instrument(path: str | os.PathLike[str]) -> Instrument:
    """Read an instrument from a TOML file.

    Parameters
    ----------
    path : path-like
        The file. What it holds is in ``docs/instrument.md``.

    Raises
    ------
    ValueError
        If something is missing, unknown or out of range; the message names the file, the field,
        the value and what is allowed.
    OSError
        If the file cannot be opened.
    """
    with open(path, "rb") as file:
        content = file.read(LARGEST + 1)
    return parse_instrument(content, os.fspath(path))


def parse_instrument(content: bytes, where: str) -> Instrument:
    """Make an instrument of the content of a TOML file; errors as of `read_instrument`.

    ``where`` is what errors call the file.
    """
    if len(content) > LARGEST:
        raise ValueError(f"{where} has more than {LARGEST} bytes; that is no instrument.")
    try:
        tables = tomllib.loads(content.decode())
    except UnicodeDecodeError as error:
        raise ValueError(f"{where} is not UTF-8 text (byte {error.start}).") from None
    except tomllib.TOMLDecodeError as error:
        raise ValueError(f"{where} is no TOML file: {one_line(error)}.") from None
    except (RecursionError, ValueError) as error:
        raise ValueError(f"{where} is no TOML file that can be read: {one_line(error)}.") from None
    try:
        return _instrument(tables)
    except ValueError as error:
        raise ValueError(f"{where}: {error}") from None


def _instrument(tables: dict[str, Any]) -> Instrument:
    _known_keys(tables, (*TEXTS, *TABLES), "")
    texts = {key: _text(key, tables[key]) for key in TEXTS if key in tables}
    if "name" not in texts:
        raise ValueError('name is missing; add name = "..." at the top.')
    _short_name("name", texts["name"])
    sources = {
        key: _text(f"sources.{key}", text) for key, text in _table(tables, "sources").items()
    }
    shared = _table(tables, "all_channels")
    if "channels" not in tables:
        raise ValueError("there is no channel; add a table [channels.NAME].")
    channels = {}
    for name, table in _table(tables, "channels").items():
        where = f"channels.{name}"
        _short_name(where, name)
        own = _subtable(where, table)
        channels[name] = _channel(name, own, shared)
    filters = {}
    for name, table in _table(tables, "filters").items():
        where = f"filters.{name}"
        _short_name(where, name)
        if name == OPEN:
            raise ValueError(f"{where}: every wheel has an open place; leave it out.")
        filters[name] = _filter(name, _subtable(where, table))
    return Instrument(channels=channels, filters=filters, sources=sources, **texts)


def _channel(name: str, own: dict[str, Any], shared: dict[str, Any]) -> Channel:
    """Make a channel of its own numbers and those that all channels share."""
    known = tuple(one.name for one, _ in numbers(Channel))
    _known_keys(own, known, f"channels.{name}")
    _known_keys(shared, known, "all_channels")
    # an area of its own takes the place of a shared ratio, and the reverse
    rivals = ("cps_per_flux", "effective_area", "area_wavelength")
    if any(key in own for key in rivals):
        shared = {key: value for key, value in shared.items() if key not in rivals}
    facts = {}
    for one, allowed in numbers(Channel):
        where = f"channels.{name}" if one.name in own else "all_channels"
        table = own if one.name in own else shared
        if one.name in table:
            facts[one.name] = _fact(f"{where}.{one.name}", table[one.name], allowed)
        elif one.default is MISSING:
            raise ValueError(
                f"channels.{name} has no {one.name}; add it there or in [all_channels]: "
                f"{one.name} = {_example(allowed)}."
            )
    channel: Channel = _made(Channel, f"channels.{name}", name, facts)
    return channel


def _filter(name: str, table: dict[str, Any]) -> NamedFilter:
    """Make a filter of the kind that has these numbers."""
    wanted: dict[Any, tuple[str, ...]] = {
        kind: tuple(one.name for one, _ in numbers(kind)) for kind in FILTER_KINDS
    }
    best = max(wanted, key=lambda kind: len(set(wanted[kind]) & set(table)))
    if set(wanted[best]) != set(table):
        kinds = "; or ".join(", ".join(names) for names in wanted.values())
        raise ValueError(
            f"filters.{name} has {', '.join(table) or 'no numbers'}; a filter has {kinds}."
        )
    facts = {
        one.name: _fact(f"filters.{name}.{one.name}", table[one.name], allowed)
        for one, allowed in numbers(best)
    }
    made: NamedFilter = _made(best, f"filters.{name}", name, facts)
    return made


def _made(kind: Any, where: str, name: str, facts: Mapping[str, Fact]) -> Any:
    values = {key: fact.value for key, fact in facts.items()}
    try:
        return kind(name=name, facts=facts, **values)
    except ValueError as error:
        raise ValueError(f"{where}.{error}") from None


def _fact(where: str, given: Any, allowed: Number) -> Fact:
    """Read a number with its unit, status and source."""
    if not isinstance(given, dict):
        raise ValueError(
            f"{where} is {_brief(given)}; write a number with its origin, {_example(allowed)}."
        )
    _known_keys(given, PARTS, where)
    missing = [part for part in PARTS if part not in given]
    if not allowed.unit and missing == ["unit"]:
        missing = []
    if missing:
        raise ValueError(f"{where} has no {missing[0]}; write {_example(allowed)}.")
    unit = _text(f"{where}.unit", given.get("unit", ""), empty=True)
    if unit != allowed.unit and not _same_unit(unit, allowed.unit):
        raise ValueError(
            f"{where}: unit is {unit!r}; convert the number to "
            + (f"{allowed.unit!r}." if allowed.unit else "one without a unit.")
        )
    status = given["status"]
    if status not in STATUSES:
        raise ValueError(f"{where}: status is {_brief(status)}; known: {', '.join(STATUSES)}.")
    source = _text(f"{where}.source", given["source"])
    try:
        value = allowed.checked(given["value"])
    except ValueError as error:
        raise ValueError(f"{where}: {error}") from None
    return Fact(value, allowed.unit, status, source)


def _same_unit(given: str, wanted: str) -> bool:
    if len(given) > 60:
        return False
    try:
        return bool(u.Unit(given) == u.Unit(wanted))
    except (ValueError, TypeError):
        return False


def _example(allowed: Number) -> str:
    value = {1: "...", 2: "[..., ...]"}.get(allowed.count or 0, "[..., ..., ...]")
    unit = f'unit = "{allowed.unit}", ' if allowed.unit else ""
    return f'{{ value = {value}, {unit}status = "assumed", source = "..." }}'


def _known_keys(table: Mapping[str, Any], known: tuple[str, ...], where: str) -> None:
    for key in table:
        if key not in known:
            near = get_close_matches(key, known, 1)
            remedy = f"did you mean {near[0]}?" if near else f"known: {', '.join(known)}."
            raise ValueError(f"{where or 'the file'} has the unknown key {_brief(key)}; {remedy}")


def _table(tables: dict[str, Any], key: str) -> dict[str, Any]:
    return _subtable(key, tables.get(key, {}))


def _subtable(where: str, table: Any) -> dict[str, Any]:
    if not isinstance(table, dict):
        raise ValueError(f"{where} is {_brief(table)}; it must be a table, [{where}].")
    return table


def _text(where: str, text: Any, *, empty: bool = False) -> str:
    if not isinstance(text, str) or not (text.strip() or empty):
        raise ValueError(f"{where} is {_brief(text)}; it must be a text in quotes.")
    if not (text.isascii() and (text.isprintable())) or len(text) > LONGEST_TEXT:
        raise ValueError(
            f"{where} is {_brief(text)}; it must be one line of at most {LONGEST_TEXT} ASCII "
            "characters, as FITS headers are."
        )
    return text


def _short_name(where: str, name: str) -> None:
    if not name.isascii() or not name.isprintable() or not 0 < len(name) <= LONGEST_NAME:
        raise ValueError(
            f"{where}: {_brief(name)} must be a name of at most {LONGEST_NAME} ASCII characters."
        )
    if name != name.strip():
        raise ValueError(f"{where}: {name!r} begins or ends with a space; take it away.")


def _brief(value: Any) -> str:
    try:
        text = repr(value)
    except (ValueError, RecursionError):
        return "something too long"
    return text if len(text) <= 60 else f"{text[:57]}..."
