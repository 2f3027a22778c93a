"""LIBERO's suites and tasks: the sentence and the goal of each as its BDDL file has them."""

from __future__ import annotations

import contextlib
import io
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np
from libero.libero import benchmark, get_libero_path
from libero.libero.envs import bddl_utils
from numpy.typing import NDArray

BASE = ("libero_spatial", "libero_object", "libero_goal", "libero_10")
STANDARD = (*BASE, "libero_90")
PRO = tuple(f"{suite}_{change}" for suite in BASE for change in ("lan", "object", "swap", "task"))


@dataclass(frozen=True, slots=True)
class LiberoTask:
    """One task of a suite.

    Attributes:
        suite: The suite's name.
        number: Its place there, from 0.
        bddl: Its file.
        sentence: What its file asks for; the interface's own `language` is made of the file's name and says another thing in PRO.
        goal: Predicates and their arguments, all of which are to hold.
    """

    suite: str
    number: int
    bddl: Path
    sentence: str
    goal: tuple[tuple[str, ...], ...]

    def state(self, number: int) -> NDArray[np.float64]:
        """Return an initial state as MuJoCo's flattened state."""
        states = _suite(self.suite).get_task_init_states(self.number)
        return np.asarray(states[number], dtype=np.float64)


def tasks_of(suite: str) -> tuple[LiberoTask, ...]:
    """Return the tasks of a suite, in its order."""
    return tuple(_task(suite, number) for number in range(_suite(suite).n_tasks))


def _task(suite: str, number: int) -> LiberoTask:
    task = _suite(suite).get_task(number)
    bddl = Path(get_libero_path("bddl_files")) / task.problem_folder / task.bddl_file
    problem = bddl_utils.robosuite_parse_problem(str(bddl))
    goal = tuple(tuple(str(word) for word in predicate) for predicate in problem["goal_state"])
    return LiberoTask(suite, number, bddl, " ".join(problem["language_instruction"]), goal)


@cache
def _suite(name: str) -> benchmark.Benchmark:
    # It prints the order of its tasks.
    with contextlib.redirect_stdout(io.StringIO()):
        return benchmark.get_benchmark(name)(task_order_index=0)
