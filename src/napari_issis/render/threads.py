"""Work spread over the processor's cores; numpy and scipy let go of Python's lock in their loops.

Threads that want the lock at the same time wait for each other, and waking one takes as long as
a small array operation. So there are no more threads at work than cores, whoever has nothing to
do takes part in what is left, and the pieces of work are large.
"""

from __future__ import annotations

import os
from collections import deque
from collections.abc import Callable, Iterable, Iterator
from functools import lru_cache
from threading import Condition, Thread
from typing import Any, TypeVar

# lines of a mesh in a piece of work: what a core's cache holds, and with several threads more
LINES, LINES_OF_SEVERAL = 16, 64
# more threads than this wait for the memory
MOST = 8

Item = TypeVar("Item")
Result = TypeVar("Result")


def cores() -> int:
    """Processors that this process may use, at most `MOST`."""
    if hasattr(os, "sched_getaffinity"):
        return min(len(os.sched_getaffinity(0)), MOST)
    return min(os.cpu_count() or 1, MOST)


class _Share:
    """Work to be done for each of some items, by every thread that takes part.

    It refers to no function that refers to it: the arrays that it holds are free at its end.
    """

    def __init__(self, work: Callable[[Any], None], items: Iterable[Any]) -> None:
        self.work = work
        self.left = deque(items)
        self.at_work = 0
        self.errors: list[BaseException] = []

    def ended(self) -> bool:
        return not self.left and not self.at_work

    def take_on(self) -> None:
        try:
            while self.left:
                try:
                    item = self.left.popleft()
                except IndexError:  # another thread was quicker
                    break
                self.work(item)
        except BaseException as error:
            self.errors.append(error)
            self.left.clear()


class _Team:
    """As many threads as cores, the calling one among them, and the work that is open to them."""

    def __init__(self) -> None:
        self.changed = Condition()
        self.open: list[_Share] = []
        for _ in range(cores() - 1):
            Thread(target=self.take_part, name="napari-issis", daemon=True).start()

    def offer(self, share: _Share) -> None:
        with self.changed:
            self.open.append(share)
            self.changed.notify_all()

    def take_part(self, ended: Callable[[], bool] = lambda: False) -> None:
        """Do whatever is open until something has ended."""
        while True:
            with self.changed:
                self.changed.wait_for(lambda: self.open or ended())
                if ended():
                    return
                share = self.open[-1]
                share.at_work += 1
            self.do(share)
            del share  # and with it the arrays that it holds

    def do(self, share: _Share) -> None:
        """Take on a share in which this thread has been counted."""
        share.take_on()
        with self.changed:
            share.at_work -= 1
            if share in self.open:
                self.open.remove(share)
            self.changed.notify_all()


@lru_cache(maxsize=1)
def _team_of(process: int) -> _Team:
    return _Team()


def _team() -> _Team:
    # a child of os.fork has no threads: it makes its own
    return _team_of(os.getpid())


def alongside(work: Callable[[], Result]) -> Callable[[], Result]:
    """Begin some work in another thread; the function returned takes part and gives its result."""
    if cores() == 1:
        return work
    results: list[Result] = []
    share = _Share(lambda _: results.append(work()), [None])
    _team().offer(share)

    def result() -> Result:
        _team().take_part(share.ended)
        if share.errors:
            raise share.errors[0]
        return results[0]

    return result


def for_each(work: Callable[[Item], None], items: Iterable[Item]) -> None:
    """Do ``work`` for every item; the calling thread takes part."""
    if cores() == 1:
        for item in items:
            work(item)
        return
    team, share = _team(), _Share(work, items)
    share.at_work += 1
    team.offer(share)
    team.do(share)
    with team.changed:
        team.changed.wait_for(share.ended)
    if share.errors:
        raise share.errors[0]


def blocks(count: int, size: int) -> Iterator[slice]:
    """Cut a range into slices of a size."""
    return (slice(first, min(first + size, count)) for first in range(0, count, size))


def pieces(lines: int) -> Iterator[slice]:
    """Cut the lines of a mesh into pieces of work."""
    return blocks(lines, LINES if cores() == 1 else LINES_OF_SEVERAL)
