"""Pieces of work for threads."""

import threading

import pytest

from warpjld.runtime.threads import cores, each_in_threads, in_threads, one_blas_thread, threads_for


@pytest.mark.parametrize("threads", [-1, 1, 2, 3, 16])
@pytest.mark.parametrize("count", [0, 1, 2, 7, 100])
def test_every_row_is_done_once_in_at_most_that_many_threads(count: int, threads: int) -> None:
    from warpjld_kernels.overlaps import overlapping_boxes

    pieces, names = [], set()

    def span(begin: int, end: int) -> None:
        pieces.append((begin, end))
        names.add(threading.current_thread().name)

    in_threads(span, count, threads, overlapping_boxes, "cpu")
    assert [k for begin, end in sorted(pieces) for k in range(begin, end)] == list(range(count))
    assert all(begin < end for begin, end in pieces)
    assert len(names) <= max(1, min(threads, count))


def test_an_error_in_any_thread_is_raised() -> None:
    from warpjld_kernels.overlaps import overlapping_boxes

    def span(begin: int, end: int) -> None:
        if end == 10:
            raise RuntimeError("in the last piece")

    with pytest.raises(RuntimeError, match="last piece"):
        in_threads(span, 10, 3, overlapping_boxes, "cpu")


@pytest.mark.parametrize("count", [0, 2, 6])
def test_each_item_has_its_result_and_two_run_at_once(count: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("warpjld.runtime.threads.cores", lambda: 2)
    two = threading.Barrier(2)

    def square(item: int) -> int:
        two.wait(10.0)  # fails where no other item is being worked on
        return item * item

    assert each_in_threads(square, range(count)) == [item * item for item in range(count)]


def test_an_error_of_any_item_is_raised() -> None:
    with pytest.raises(ZeroDivisionError):
        each_in_threads(lambda item: 1 / item, [3, 2, 1, 0])


def test_little_work_is_not_split() -> None:
    assert threads_for(0, 100) == threads_for(199, 100) == 1
    assert threads_for(10**9, 1) == cores()


def test_linear_algebra_is_kept_to_one_thread_and_let_go_again() -> None:
    import scipy.linalg  # noqa: F401
    from threadpoolctl import threadpool_info, threadpool_limits

    def threads() -> set[int]:
        return {library["num_threads"] for library in threadpool_info() if library["user_api"] == "blas"}

    with threadpool_limits(2, user_api="blas"):
        before = threads()
        with one_blas_thread(), one_blas_thread():
            assert threads() == {1}
        assert threads() == before


def test_contact_is_solved_on_one_thread_of_linear_algebra() -> None:
    from threadpoolctl import threadpool_info, threadpool_limits

    from warpjld.fem import Body, LinearElastic, box_hexes, prescribe
    from warpjld.fem.contact import Pair, press
    from warpjld.fem.contact.obstacles.solids import Plane

    mesh = box_hexes((1.0, 1.0, 1.0), (2, 2, 2))
    seen: list[int] = []

    def look(text: str) -> None:
        seen.extend(library["num_threads"] for library in threadpool_info() if library["user_api"] == "blas")

    with threadpool_limits(2, user_api="blas"):
        down = prescribe(mesh, "z+", x=0.0, y=0.0, z=-0.01)
        press(Body(mesh, LinearElastic(1.0, 0.3)), down, [Pair("z-", Plane((0, 0, 0), (0, 0, 1)))], progress=look)
    assert seen
    assert set(seen) == {1}
