"""Threads that measure, run and show at the same time find what one thread finds, to the last digit."""

import random
import sys
import threading
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field

import numpy as np
import pytest
from kinds import KINDS, problem
from strategies import AT_NIGHT
from threadpoolctl import threadpool_info, threadpool_limits

from verification.constants import measure
from verification.interface.pair import pair_from
from verification.machine import threads
from verification.machine.threads import one_thread
from verification.semidefinite.multipliers import QuadraticForms

THREADS = 8


#: Those that take long on a mesh on which a second BLAS thread has work.
LONG = ("Comparison", "Certificate", "Checked", "ContinuumCertificate")


@pytest.fixture
def in_threads():
    """``in_threads(function, names)``: what a function gives for each name, in threads that change often."""
    before = sys.getswitchinterval()
    sys.setswitchinterval(1e-4)

    def run(function, names):
        with ThreadPoolExecutor(THREADS) as pool:
            return list(pool.map(function, names))

    yield run
    sys.setswitchinterval(before)


@pytest.fixture(scope="module")
def results() -> dict[str, object]:
    """By day not the one that takes as long as all others together."""
    return {name: make(problem(10)) for name, make in KINDS.items() if AT_NIGHT or name != LONG[-1]}


def test_views_made_in_threads_are_those_of_one_thread(results, in_threads):
    alone = {name: result._repr_html_() for name, result in results.items()}
    names = [*results] * (100 if AT_NIGHT else 3)
    random.Random(0).shuffle(names)
    views = in_threads(lambda name: results[name]._repr_html_(), names)
    assert [name for name, view in zip(names, views, strict=True) if view != alone[name]] == []


def test_sections_made_in_threads_are_those_of_one_thread(results, in_threads):
    comparison = results["Comparison"]
    alone, times = comparison.sections(), 200 if AT_NIGHT else 8
    assert in_threads(lambda _: comparison.sections(), range(times)) == [alone] * times


def test_numbers_found_in_threads_are_those_of_one_thread(in_threads):
    """The main thread has set a number of BLAS threads: threadpoolctl would ignore what another thread sets."""
    names = [name for name in KINDS if AT_NIGHT or name not in LONG]
    given = problem(60)
    find = lambda name: KINDS[name](given).to_json()
    with threadpool_limits(4, user_api="blas"):
        alone = {name: find(name) for name in names}
        asked = names * (8 if AT_NIGHT else 1)
        random.Random(0).shuffle(asked)
        found = in_threads(find, asked)
    assert [name for name, document in zip(asked, found, strict=True) if document != alone[name]] == []


def test_quadratic_forms_have_the_digits_of_one_blas_thread():
    """Comparisons and certificates build on them; the test above runs these two by night only."""
    pair = pair_from(problem(60))
    measured = measure(pair)

    def rows(blas_threads):
        with threadpool_limits(blas_threads, user_api="blas"):
            forms = QuadraticForms(pair, measured)
        return [forms.p, forms.carried, *(side for family in forms.families for side in family)]

    assert all(map(np.array_equal, rows(1), rows(2)))  # more than there are cores crash OpenBLAS 0.3.28


def numbers() -> set[int]:
    """The numbers of threads of those BLAS libraries that can have more than one."""
    several = [library for library in threadpool_info() if library.get("threading_layer") != "disabled"]
    return {library["num_threads"] for library in several if library["user_api"] == "blas"}


def in_thread(function):
    with ThreadPoolExecutor(1) as pool:
        return pool.submit(function).result()


def test_blas_has_one_thread_until_the_last_thread_has_left():
    entered, leave = threading.Event(), threading.Event()

    def other():
        with one_thread():
            entered.set()
            assert leave.wait(10)

    with threadpool_limits(3, user_api="blas"), ThreadPoolExecutor(1) as pool:
        with one_thread():
            waiting = pool.submit(other)
            assert entered.wait(10)
        assert numbers() == {1}
        leave.set()
        waiting.result()
        assert numbers() == {3}


def test_a_number_that_was_set_while_a_context_is_open_is_1_again_in_the_next_one():
    with threadpool_limits(2, user_api="blas"):
        with one_thread():
            threadpool_limits(3, user_api="blas")
            with one_thread():
                assert numbers() == {1}
        assert numbers() == {3}


def test_blas_has_one_thread_in_a_thread_whose_main_thread_set_several():
    def inside():
        with one_thread(), one_thread():
            return numbers()

    with threadpool_limits(3, user_api="blas"):
        assert in_thread(inside) == {1}
        assert numbers() == {3}


def test_an_exception_in_one_thread_leaves_blas_to_the_other():
    def fail():
        with one_thread():
            raise KeyError

    with threadpool_limits(3, user_api="blas"):
        with one_thread():
            with pytest.raises(KeyError):
                in_thread(fail)
            assert numbers() == {1}
        assert numbers() == {3}


def test_a_thread_may_set_a_number_after_ours_has_left():
    with one_thread():
        pass

    def set_three():
        with threadpool_limits(3, user_api="blas"):
            return numbers()

    assert in_thread(set_three) == {3}


@dataclass(eq=False)
class OfEachThread:
    """A BLAS library on OpenMP: each thread of Python has its own number."""

    threading_layer = "openmp"
    own: threading.local = field(default_factory=threading.local)

    @property
    def num_threads(self):
        return getattr(self.own, "number", 4)

    def set_num_threads(self, number):
        self.own.number = number


def test_a_library_with_a_number_for_each_thread_gets_it_back_in_each_thread(monkeypatch):
    library = OfEachThread()
    monkeypatch.setattr(threads, "libraries", lambda: ([], [library]))

    def inside():
        with one_thread():
            within = library.num_threads
        return within, library.num_threads

    with one_thread():
        assert in_thread(inside) == (1, 4)
        assert library.num_threads == 1
    assert library.num_threads == 4
