import os
import signal
import subprocess
import sys
import textwrap
import threading
import time
from concurrent.futures import Executor, Future, ThreadPoolExecutor
from pathlib import Path

import pytest

from robots.common import parallel
from robots.common.errors import InputError, OedError
from robots.common.parallel import (
    BLAS_VARIABLES,
    as_finished,
    available_cores,
    parallel_map,
    single_blas_thread,
    threaded,
)
from tests.robots.common import cluster_jobs

ROOT = Path(__file__).parents[3]


class Recorder:
    def __init__(self):
        self.calls = []

    def start(self, task, total=None):
        self.calls.append(("start", task, total))

    def update(self, done, note=""):
        self.calls.append(("update", done))

    def finish(self):
        self.calls.append(("finish",))


class SerialExecutor(Executor):
    """The least that an executor can be."""

    def submit(self, fn, /, *args, **kwargs):
        future = Future()
        future.set_running_or_notify_cancel()
        try:
            future.set_result(fn(*args, **kwargs))
        except Exception as error:
            future.set_exception(error)
        return future


@pytest.fixture
def jobs(tmp_path, monkeypatch):
    """A module that spawned workers can import by name, as they could not a test file that was imported by path."""
    (tmp_path / "parallel_jobs.py").write_text(
        textwrap.dedent(
            """
            import os, time
            from robots.common.errors import InfeasibleError
            from robots.common.parallel import BLAS_VARIABLES

            def late(x):
                time.sleep(0.05 * (3 - x))
                return x

            def where(_):
                return os.getpid(), {name: os.environ.get(name) for name in BLAS_VARIABLES}

            def fail(x):
                if x == 1:
                    raise InfeasibleError("no motion", joint=2)
                return x

            def die(_):
                os._exit(3)
            """
        )
    )
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.delitem(sys.modules, "parallel_jobs", raising=False)
    import parallel_jobs

    yield parallel_jobs
    sys.modules.pop("parallel_jobs", None)


@pytest.mark.slow
def test_processes_keep_the_order_and_use_one_blas_thread(jobs, monkeypatch):
    """Results come in order, from other processes with one BLAS thread; the environment is restored."""
    monkeypatch.setenv("OMP_NUM_THREADS", "7")
    monkeypatch.delenv("MKL_NUM_THREADS", raising=False)
    before = dict(os.environ)
    assert parallel_map(jobs.late, range(4), workers=2) == [0, 1, 2, 3]
    seen = parallel_map(jobs.where, range(3), workers=2)
    assert all(pid != os.getpid() and set(threads.values()) == {"1"} for pid, threads in seen)
    assert dict(os.environ) == before


@pytest.mark.slow
def test_exception_crosses_processes_as_itself(jobs):
    """An error of ours arrives with its kind and fields."""
    from robots.common.errors import InfeasibleError

    with pytest.raises(InfeasibleError) as caught:
        parallel_map(jobs.fail, range(3), workers=2)
    assert (caught.value.problem, caught.value.joint) == ("no motion", 2)


@pytest.mark.slow
def test_death_of_workers_again_and_again_is_explained(jobs, monkeypatch):
    """Workers that end abruptly whenever they begin an item are an error of ours that says what to do."""
    monkeypatch.setattr(parallel, "MOST_LOSSES", 1)
    with pytest.raises(OedError, match="2 times in a row; memory may have run out"):
        parallel_map(jobs.die, range(2), workers=2)


@pytest.mark.slow
def test_lost_items_are_done_again(tmp_path):
    """A worker that ends abruptly once costs time only: all results are there, in order."""
    tasks = [(tmp_path, number) for number in range(5)]
    assert parallel_map(cluster_jobs.dies_once, tasks, workers=2) == [0, 1, 4, 9, 16]
    assert (tmp_path / "died").exists()


@pytest.mark.slow
def test_script_without_a_main_guard(tmp_path):
    """A script that starts its work when it is imported ends with one error that names the guard, without retries."""
    script = tmp_path / "script.py"
    script.write_text("from robots.common.parallel import parallel_map\nparallel_map(abs, [1, 2], workers=2)\n")
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    done = subprocess.run([sys.executable, script], env=environment, capture_output=True, text=True, timeout=60)
    assert done.returncode == 1
    assert done.stderr.rstrip().splitlines()[-1].startswith("robots.common.errors.OedError: the worker processes ended")
    assert "__main__" in done.stderr.splitlines()[-1]


def test_results_come_as_they_are_finished():
    """A finished item can be kept, with its number, while an earlier one runs."""
    gate = threading.Event()
    with ThreadPoolExecutor(2) as pool:
        results = as_finished(lambda x: gate.wait(10) if x == 0 else x, [0, 1], executor=pool)
        assert next(results) == (1, 1)
        gate.set()
        assert list(results) == [(0, True)]


@pytest.mark.parametrize(("items", "workers"), [([3], None), ([3], 4), ([1, 2, 3], 1), ([], None)])
def test_little_work_stays_in_this_process(items, workers):
    """One item, one worker or nothing to do needs no process: a local function works."""
    pids = []

    def square(x):
        pids.append(os.getpid())
        return x * x

    assert parallel_map(square, items, workers=workers) == [x * x for x in items]
    assert set(pids) <= {os.getpid()}


@pytest.mark.parametrize("workers", [0, -1])
def test_number_of_workers_is_positive(workers):
    """No worker at all is an input error."""
    with pytest.raises(InputError, match=f"{workers} workers"):
        parallel_map(abs, [1, 2], workers=workers)


def test_iterator_of_items_is_consumed_once():
    """Items may be a generator."""
    assert parallel_map(abs, (x for x in (-1, -2)), workers=1) == [1, 2]


def test_any_executor_serves_and_stays_open():
    """An executor that was given keeps the order and is not shut down."""
    with ThreadPoolExecutor(3) as pool:
        for executor in (pool, SerialExecutor()):
            assert parallel_map(lambda x: time.sleep(0.01 * (3 - x)) or x, range(4), executor=executor) == [0, 1, 2, 3]
        assert pool.submit(abs, -1).result() == 1
        assert parallel_map(abs, [], executor=pool) == []


@pytest.mark.parametrize("executor", [None, SerialExecutor()])
def test_progress_hears_of_every_item(executor):
    """The listener hears the start with the total, each finished item, and the end."""
    recorder = Recorder()
    parallel_map(abs, range(3), workers=1, executor=executor, progress=recorder, task="sweep")
    updates = [("update", 1.0), ("update", 2.0), ("update", 3.0)]
    assert recorder.calls == [("start", "sweep", 3.0), *updates, ("finish",)]


def test_progress_comes_as_items_finish():
    """A finished item is reported while an earlier one still runs."""
    gate, recorder = threading.Event(), Recorder()
    recorder.update = lambda done, note="": gate.set()
    with ThreadPoolExecutor(2) as pool:
        assert parallel_map(lambda x: gate.wait(10) if x == 0 else x, [0, 1], executor=pool, progress=recorder)[0]


@pytest.mark.parametrize("workers", [1, None])
def test_progress_ends_after_a_failure(workers):
    """The listener hears the end when an item fails, and the error passes as itself."""
    recorder = Recorder()
    executor = None if workers else SerialExecutor()
    with pytest.raises(ZeroDivisionError):
        parallel_map(lambda x: 1 / x, [1, 0, 2], workers=workers, executor=executor, progress=recorder)
    assert recorder.calls[-1] == ("finish",)


@pytest.mark.parametrize("error", [ValueError, KeyboardInterrupt])
def test_failure_cancels_what_has_not_begun(error):
    """After a failure or an interrupt, items that wait are cancelled."""
    begun, recorder = [], Recorder()

    def interrupt(done, note=""):
        raise error

    recorder.update = interrupt
    with ThreadPoolExecutor(1) as pool, pytest.raises(error):
        parallel_map(lambda x: begun.append(x) or time.sleep(0.05), range(20), executor=pool, progress=recorder)
    assert len(begun) < 20


def test_failing_submission_cancels_what_waits():
    """If the executor refuses an item, earlier ones that have not begun are cancelled."""

    class Closing(Executor):
        def __init__(self):
            self.futures = []

        def submit(self, fn, /, *args, **kwargs):
            if self.futures:
                raise RuntimeError("closed")
            self.futures.append(Future())
            return self.futures[0]

    executor = Closing()
    with pytest.raises(RuntimeError, match="closed"):
        parallel_map(abs, [1, 2], executor=executor)
    assert executor.futures[0].cancelled()


def test_environment_is_restored_after_an_error(monkeypatch):
    """The limit of BLAS threads ends with its block, also on an error."""
    monkeypatch.setenv("OPENBLAS_NUM_THREADS", "5")
    before = dict(os.environ)
    seen = set()
    with pytest.raises(ZeroDivisionError), single_blas_thread():
        seen.update(os.environ[name] for name in BLAS_VARIABLES) or 1 / 0
    assert seen == {"1"}
    assert dict(os.environ) == before


def test_at_least_one_core_is_available(monkeypatch):
    """The number of cores is positive, also where the system does not know affinities."""
    assert available_cores() >= 1
    monkeypatch.delattr(os, "sched_getaffinity", raising=False)
    monkeypatch.setattr(os, "cpu_count", lambda: None)
    assert available_cores() == 1


@pytest.mark.slow
@pytest.mark.skipif(os.name == "nt", reason="POSIX signals to a process group")
def test_interrupt_from_a_terminal_ends_workers_without_their_tracebacks(tmp_path):
    """An interrupt of the process group ends the script by KeyboardInterrupt soon, and workers write nothing."""
    script = tmp_path / "script.py"
    script.write_text(
        textwrap.dedent(
            """
            import pathlib, sys, time
            from robots.common.parallel import parallel_map

            def work(x):
                pathlib.Path(sys.argv[1], f"begun{x}").touch()
                time.sleep(60)

            if __name__ == "__main__":
                try:
                    parallel_map(work, range(8), workers=2)
                except KeyboardInterrupt:
                    print("interrupted")
            """
        )
    )
    process = subprocess.Popen(
        [sys.executable, str(script), str(tmp_path)],
        env={**os.environ, "PYTHONPATH": str(ROOT)},
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )
    try:
        deadline = time.monotonic() + 60
        while len(list(tmp_path.glob("begun*"))) < 2:
            assert time.monotonic() < deadline, "the workers did not begin"
            time.sleep(0.02)
        os.killpg(process.pid, signal.SIGINT)
        out, err = process.communicate(timeout=30)
    finally:
        if process.poll() is None:
            os.killpg(process.pid, signal.SIGKILL)
            process.communicate()
    assert out == "interrupted\n"
    assert err == ""


@pytest.mark.parametrize("cores", [1, 3])
def test_threads_keep_the_order_and_raise_what_was_raised(monkeypatch, cores):
    """Results come in the order of the items, on any number of cores, also where the first takes the longest."""
    monkeypatch.setattr(parallel, "available_cores", lambda: cores)
    assert list(threaded(lambda x: x * x, range(50))) == [x * x for x in range(50)]
    assert list(threaded(lambda wait: time.sleep(wait) or wait, [0.05, 0.02, 0.0])) == [0.05, 0.02, 0.0]
    with pytest.raises(ZeroDivisionError):
        list(threaded(lambda x: 1 / x, [1, 0]))
