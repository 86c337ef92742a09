"""Work shared among threads."""

from __future__ import annotations

import gc
import os
import threading
import weakref

import numpy as np
import pytest

from napari_issis.render import threads
from napari_issis.render.threads import alongside, for_each, pieces


@pytest.fixture(params=[1, 2, 4])
def team(request, monkeypatch):
    """So many threads at work."""
    monkeypatch.setattr(threads, "cores", lambda: request.param)
    threads._team_of.cache_clear()
    yield request.param
    threads._team_of.cache_clear()


def test_each_item_is_done_once(team):
    """Catches an item taken by two threads, and a return before the last one is done."""
    for number in (0, 1, 7, 200):
        done = [0] * number

        def work(item, done=done):
            np.fft.fft(np.ones(1000))
            done[item] += 1

        for_each(work, range(number))
        assert done == [1] * number


def test_the_caller_takes_part_and_so_do_others(team):
    """Catches a caller that sleeps, and helpers that are never called."""
    barrier = threading.Barrier(team)
    names = set()

    def work(_item):
        # passed only when so many threads are at work at the same time
        barrier.wait(timeout=20)
        names.add(threading.current_thread())

    for_each(work, range(team))
    assert len(names) == team
    assert threading.current_thread() in names


def test_work_alongside_is_shared_by_whoever_waits_for_it(team):
    """Catches a caller that waits idly for work in another thread, or gets no result."""
    names = set()
    begun, free = threading.Event(), threading.Event()
    inside = threading.Barrier(team)

    def work(_item):
        inside.wait(timeout=20)
        names.add(threading.current_thread())

    def everything():
        begun.set()
        free.wait(timeout=0 if team == 1 else 20)
        for_each(work, range(team))
        return "done"

    result = alongside(everything)
    if team > 1:
        assert begun.wait(timeout=20)
    free.set()
    assert result() == "done"
    assert len(names) == team


def test_errors_reach_the_caller_and_end_the_rest(team):
    """Catches errors that vanish in a thread, and work that goes on after one."""
    done = []

    def work(item):
        if item == 3:
            raise ValueError("item 3")
        done.append(item)

    with pytest.raises(ValueError, match="item 3"):
        for_each(work, range(10_000))
    assert len(done) < 10_000
    with pytest.raises(ZeroDivisionError):
        alongside(lambda: 1 / 0)()
    for_each(done.append, [-1])
    assert done[-1] == -1


def test_what_the_work_holds_is_free_at_its_end(team):
    """Catches threads and cycles that hold on to arrays until some later time."""
    gc.disable()
    try:
        array = np.zeros(team)
        gone = weakref.ref(array)
        together = threading.Barrier(team)

        def work(item, array=array):
            together.wait(timeout=20)
            array[item] += 1

        def all_of_it(work=work):
            for_each(work, range(team))

        alongside(all_of_it)()
        del work, all_of_it, array
        if team > 1:  # the other threads let go when they wait again
            changed = threads._team().changed
            for _ in range(100):
                with changed:
                    changed.wait(timeout=0.01)
                if gone() is None:
                    break
        assert gone() is None
    finally:
        gc.enable()


@pytest.mark.skipif(not hasattr(os, "fork"), reason="no fork")
@pytest.mark.filterwarnings("ignore:.*fork.*:DeprecationWarning")
def test_a_forked_process_has_threads_of_its_own(team):
    """Catches a child that counts on its parent's threads."""
    for_each(lambda _item: None, range(5))
    together = threading.Barrier(team)
    child = os.fork()
    if not child:
        for_each(lambda _item: together.wait(timeout=20), range(team))
        os._exit(7)
    assert os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) == 7


def test_pieces_cover_all_lines_once():
    for lines in (1, 63, 64, 65, 1000):
        covered = np.concatenate([np.arange(lines)[piece] for piece in pieces(lines)])
        assert np.array_equal(covered, np.arange(lines))
