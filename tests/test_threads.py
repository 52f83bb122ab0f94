"""Work shared out among threads: all of it is done once, its results come in their order, and as few as asked do it."""

from threading import Barrier, get_ident

import pytest

from sdf2vec.threads import in_threads, in_threads_each


@pytest.fixture
def three(monkeypatch):
    monkeypatch.setenv("SDF2VEC_THREADS", "3")


@pytest.mark.parametrize("count", [0, 1, 2, 3, 8])
def test_results_come_in_the_order_of_the_items(three, count):
    assert in_threads_each(lambda item: item * item, range(count)) == [item * item for item in range(count)]


def test_this_thread_does_its_share(three):
    all_here = Barrier(3, timeout=30)

    def which(item):
        all_here.wait()
        return get_ident()

    found = in_threads_each(which, range(3))
    assert found[0] == get_ident()
    assert len(set(found)) == 3


@pytest.mark.parametrize("wrong", range(3))
def test_an_error_in_any_thread_is_raised(three, wrong):
    with pytest.raises(ZeroDivisionError):
        in_threads_each(lambda item: 1 / (item - wrong), range(3))


@pytest.mark.parametrize(("most", "steps"), [(None, 3), (2, 2), (1, 1), (9, 3)])
def test_no_more_threads_than_asked_take_each_their_pieces(three, most, steps):
    done: list[int] = []
    in_threads(lambda first, step, pieces: done.extend(pieces[first::step]), range(10), most=most)
    firsts: list[tuple[int, int]] = []
    in_threads(lambda first, step: firsts.append((first, step)), most=most)
    assert sorted(done) == list(range(10))
    assert sorted(firsts) == [(first, steps) for first in range(steps)]
