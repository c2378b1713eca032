"""Work shared out among cores."""

from __future__ import annotations

from threading import Event

import pytest

from lacuna.estimation.problem import in_parallel, use_threads


@pytest.fixture(params=[1, 2])
def threads(request):
    use_threads(request.param)
    yield request.param
    use_threads(None)


def test_results_come_in_the_order_of_the_items_whatever_is_begun_first(threads):
    assert in_parallel(lambda x: x * x, (3, 1, 2), work=(1.0, 3.0, 2.0)) == [9, 1, 4]


def test_without_items_there_is_nothing(threads):
    assert in_parallel(str, [], work=[]) == []


def test_what_is_most_work_is_begun_first():
    use_threads(2)
    begun, second = [], Event()

    def note(item: str) -> None:
        begun.append(item)
        if item == "long":
            assert second.wait(10.0)  # the other thread does all the rest meanwhile
        if len(begun) == 3:
            second.set()

    try:
        in_parallel(note, ("short", "middle", "long"), work=(1.0, 2.0, 3.0))
    finally:
        use_threads(None)
    assert begun == ["long", "middle", "short"]
