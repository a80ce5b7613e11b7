"""Work on a real Dask scheduler with workers in processes of their own; one worker is killed."""

from __future__ import annotations

import os
import signal
import socket
import threading
import time

import numpy as np
import pytest

from robots.common.clusters import ClusterExecutor, cluster, connection
from robots.common.clusters import executor as executors
from robots.common.errors import InfeasibleError, InputError, OedError
from robots.common.parallel import as_finished, parallel_map
from tests.robots.common import cluster_jobs as jobs

pytest.importorskip("distributed", reason="a cluster needs the package distributed")
pytestmark = pytest.mark.slow


def test_killed_worker_costs_its_task_alone(dask_cluster, tmp_path):
    """Results are those of serial work to the last bit, in order, though a worker was killed; others are not redone."""
    tasks = [(tmp_path, seed) for seed in range(6)]
    heard = []

    class Listener:
        def start(self, task, total=None):
            pass

        def update(self, done, note=""):
            heard.append(done)

        def finish(self):
            pass

    def kill():
        while not (begun := list(tmp_path.iterdir())):
            time.sleep(0.01)
        os.kill(int(begun[0].suffix[1:]), signal.SIGKILL)

    threading.Thread(target=kill).start()
    with cluster(dask_cluster.scheduler_address) as executor:
        found = parallel_map(jobs.solved_slowly, tasks, executor=executor, progress=Listener())
    np.testing.assert_array_equal(found, [jobs.solved(seed) for seed in range(6)])
    assert heard == [1.0, 2.0, 3.0, 4.0, 5.0, 6.0]
    begun = [int(file.stem) for file in tmp_path.iterdir()]
    assert sorted(set(begun)) == list(range(6))
    assert len(begun) == 7  # the task of the killed worker, once more


def test_task_that_kills_its_workers(dask_cluster, monkeypatch):
    """A task that has cost more workers than the scheduler allows is an error of ours that says what to do."""
    monkeypatch.setattr(dask_cluster.scheduler, "allowed_failures", 0)
    with cluster(dask_cluster.scheduler_address) as executor, pytest.raises(OedError, match="memory may have run out"):
        parallel_map(jobs.dies, [0], executor=executor)
    dask_cluster.wait_for_workers(2)


def test_errors_and_functions_of_scripts(dask_cluster):
    """An error of ours arrives with its fields; functions that have no name to import by work, too."""
    with cluster(dask_cluster.scheduler_address) as executor:
        with pytest.raises(InfeasibleError) as caught:
            parallel_map(jobs.fail, range(3), executor=executor)
        assert (caught.value.problem, caught.value.joint) == ("no motion", 2)
        assert dict(as_finished(lambda x: 3 * x, [1, 2], executor=executor)) == {0: 3, 1: 6}


def test_messages_and_stop(dask_cluster):
    """Running tasks send messages, and end when they are asked to."""
    received, enough = [], threading.Event()

    def hear(message):
        received.append(tuple(message))
        if len(received) == 2:
            enough.set()

    with cluster(dask_cluster.scheduler_address) as executor:
        assert isinstance(executor, ClusterExecutor)
        link = executor.link(hear)
        futures = [executor.submit(jobs.until_stopped, (link, number)) for number in range(2)]
        assert enough.wait(20)
        executor.stop(link)
        assert [future.result(20) for future in futures] == [0, 1]
    assert sorted(received) == [(0, 0.5), (1, 0.5)]


def test_other_versions_are_refused(dask_cluster):
    """A worker with another version of robot-oed, or without it, is one error that names the worker."""
    address = dask_cluster.scheduler_address
    from distributed import Client

    with Client(address, set_as_default=False) as client:
        worker = next(iter(client.nthreads()))
        (before,) = client.run(jobs.set_version, "0.0.1", workers=[worker]).values()
        for version, words in (("0.0.1", "has robot-oed 0.0.1"), (None, "has no robot-oed")):
            client.run(jobs.set_version, version, workers=[worker])
            with pytest.raises(InputError, match=words) as caught, cluster(address):
                pass
            assert worker in str(caught.value)
        client.run(jobs.set_version, before, workers=[worker])


def test_no_scheduler(monkeypatch):
    """A wrong address, and a port where something else listens, are input errors within the time for an answer."""
    monkeypatch.setattr(connection, "ANSWER_TIMEOUT", 1.0)
    with socket.socket() as other:
        other.bind(("127.0.0.1", 0))
        other.listen()
        begin = time.monotonic()
        with (
            pytest.raises(InputError, match="no Dask scheduler answers at tcp://127"),
            cluster(f"tcp://127.0.0.1:{other.getsockname()[1]}"),
        ):
            pass
        assert time.monotonic() - begin < 5.0
    with pytest.raises(InputError, match="no Dask scheduler answers at nonsense"), cluster("nonsense"):
        pass


def test_cluster_without_workers(monkeypatch):
    """A cluster without workers is refused; the loss of the last worker, or of the scheduler, ends the work."""
    from distributed import LocalCluster

    monkeypatch.setattr(executors, "WORKERLESS_TIMEOUT", 0.3)
    monkeypatch.setattr(executors, "WORKER_CHECK_PERIOD", 0.1)
    quiet = {"dashboard_address": "127.0.0.1:0", "processes": False}
    with LocalCluster(n_workers=0, **quiet) as empty:
        with pytest.raises(InputError, match="has no workers"), cluster(empty.scheduler_address):
            pass
        empty.scale(1)
        empty.wait_for_workers(1)
        with cluster(empty.scheduler_address) as executor:
            empty.scale(0)
            with pytest.raises(OedError, match="has had no worker"):
                parallel_map(jobs.fail, [0, 2], executor=executor)
            monkeypatch.setattr(executors, "WORKERLESS_TIMEOUT", 100.0)
            threading.Timer(0.3, empty.close).start()
            with pytest.raises(OedError, match=r"connection to the Dask scheduler at .* was lost"):
                parallel_map(jobs.fail, [0, 2], executor=executor)
