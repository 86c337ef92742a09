"""Instruments as the text of a TOML file."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from json import dumps

from .facts import Fact, Value, facts_of
from .instrument import Channel, Instrument
from .instrument_file import TEXTS

BARE_KEY = re.compile(r"[A-Za-z0-9_-]+")


def instrument_text(instrument: Instrument) -> str:
    """Return the text of a file from which an instrument can be read, numbers bit for bit."""
    return "\n".join(_lines(instrument)) + "\n"


def _lines(instrument: Instrument) -> Iterator[str]:
    for key in TEXTS:
        if text := getattr(instrument, key):
            yield f"{key} = {dumps(text)}"
    if instrument.sources:
        yield from ("", "[sources]")
        yield from (f"{_key(key)} = {dumps(text)}" for key, text in instrument.sources.items())
    every = {name: _given(channel) for name, channel in instrument.channels.items()}
    first = next(iter(every.values()))
    shared = {
        key: fact
        for key, fact in first.items()
        if all(one.get(key) == fact for one in every.values())
    }
    yield from ("", "[all_channels]")
    yield from _facts(shared)
    for name, facts in every.items():
        yield from ("", f"[channels.{_key(name)}]")
        yield from _facts({key: fact for key, fact in facts.items() if key not in shared})
    for name, one in instrument.filters.items():
        yield from ("", f"[filters.{_key(name)}]")
        yield from _facts(facts_of(one))


def _given(channel: Channel) -> dict[str, Fact]:
    """Numbers of a channel that do not follow from others."""
    derived = "cps_per_flux" if channel.effective_area else ""
    return {key: fact for key, fact in facts_of(channel).items() if key != derived}


def _facts(facts: Mapping[str, Fact]) -> Iterator[str]:
    for key, fact in facts.items():
        unit = f"unit = {dumps(fact.unit)}, " if fact.unit else ""
        yield (
            f"{key} = {{ value = {_value(fact.value)}, {unit}"
            f"status = {dumps(fact.status)}, source = {dumps(fact.source)} }}"
        )


def _value(value: Value) -> str:
    if isinstance(value, tuple):
        return f"[{', '.join(repr(one) for one in value)}]"
    return repr(value)


def _key(text: str) -> str:
    return text if BARE_KEY.fullmatch(text) else dumps(text)
