"""Work spread over the processor's cores; numpy lets go of Python's lock in its loops."""

from __future__ import annotations

import os
from collections import deque
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from functools import lru_cache
from threading import Thread
from typing import TypeVar

Item = TypeVar("Item")
Result = TypeVar("Result")


def cores() -> int:
    """Processors that this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


@lru_cache(maxsize=1)
def _pool(process: int) -> ThreadPoolExecutor:
    return ThreadPoolExecutor(cores(), thread_name_prefix="napari-issis")


def alongside(work: Callable[[], Result]) -> Callable[[], Result]:
    """Begin some work in another thread; the function returned waits for its result."""
    if cores() == 1:
        return work
    future: Future[Result] = Future()

    def run() -> None:
        try:
            future.set_result(work())
        except BaseException as error:
            future.set_exception(error)

    Thread(target=run, name="napari-issis", daemon=True).start()
    return future.result


def in_threads(work: Callable[[Item], Result], items: Iterable[Item]) -> Iterator[Result]:
    """Results of ``work`` in the order of the items, a few of them made ahead."""
    if cores() == 1:
        yield from map(work, items)
        return
    # a child of os.fork has no threads: it makes its own
    pool = _pool(os.getpid())
    ahead: deque[Future[Result]] = deque()
    for item in items:
        ahead.append(pool.submit(work, item))
        if len(ahead) > 2 * cores():
            yield ahead.popleft().result()
    while ahead:
        yield ahead.popleft().result()


def for_each(work: Callable[[Item], None], items: Iterable[Item]) -> None:
    """Do ``work`` for every item."""
    deque(in_threads(work, items), maxlen=0)


def blocks(count: int, size: int) -> Iterator[slice]:
    """Cut a range into slices of a size."""
    return (slice(first, min(first + size, count)) for first in range(0, count, size))
