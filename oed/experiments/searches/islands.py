"""Runs the searches of a design in parallel, and ends them all at a deadline or on Ctrl-C."""

from __future__ import annotations

import time
from concurrent.futures import Executor
from dataclasses import dataclass

from threadpoolctl import threadpool_limits

from oed.experiments.problems.problem import FourierProblem
from oed.experiments.searches.board import Board, outlive_interrupts, stopped_by_interrupt
from oed.experiments.searches.search import Effort, Found, Island
from oed.experiments.solvers import Solver
from robots.common.errors import OedError
from robots.common.parallel import one_blas_thread, parallel_map
from robots.common.progress import Progress


def search_islands(
    problem: FourierProblem,
    effort: Effort,
    solver: Solver,
    *,
    seed: int,
    time_limit: float,
    keep_on_interrupt: bool,
    workers: int | None,
    executor: Executor | None,
    progress: Progress,
) -> list[Found]:
    """Searches from several starts, each apart from the others, and gives what each found.

    Args:
        problem: what to minimise.
        effort: how many islands, and how much each does.
        solver: the local solver.
        seed: of everything random.
        time_limit: for all of them [s].
        keep_on_interrupt: on Ctrl-C end them with the best so far.
        workers: processes; as many as cores by default.
        executor: runs them instead of processes of its own.
        progress: receives the steps done and the best value.
    """
    sign = -1.0 if problem.criterion.larger_is_better else 1.0
    work_name = f"designing for {problem.base.model.robot.name}"
    with (
        Board.watched(effort.islands, effort.steps, progress, work_name, sign, executor) as board,
        stopped_by_interrupt(board, wanted=keep_on_interrupt),
    ):
        deadline = time.time() + time_limit
        tasks = [
            _Task(
                problem=problem,
                effort=effort,
                solver=solver,
                seed=seed,
                number=number,
                deadline=deadline,
                board=board,
                outlive=keep_on_interrupt,
            )
            for number in range(effort.islands)
        ]
        try:
            return parallel_map(_search, tasks, executor=executor, workers=workers)
        except OedError as error:
            if board.stopped:  # by a Ctrl-C that met workers which had not begun
                raise KeyboardInterrupt from error
            raise


@dataclass(frozen=True, kw_only=True)
class _Task:
    """All that an island needs, for another process."""

    problem: FourierProblem
    effort: Effort
    solver: Solver
    seed: int
    number: int
    deadline: float
    board: Board
    outlive: bool


@one_blas_thread()
def _search(task: _Task) -> Found:
    if task.outlive:
        outlive_interrupts()
    island = Island(
        task.problem,
        task.effort,
        task.solver,
        task.seed,
        task.number,
        tell=task.board.reporter(task.number),
        deadline=task.deadline,
        halted=lambda: task.board.stopped,
    )
    # Threads inside small matrix products cost more than they bring, and would make the result depend on their number.
    with threadpool_limits(limits=1):
        return island.search()
