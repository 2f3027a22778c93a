"""What a program gets for an argument of the wrong kind: one line that names the argument and what it takes."""

from __future__ import annotations

import re
from typing import Any

import numpy as np
import pytest

from robosandbox import open_session
from robosandbox.apps.envs import ManipulationEnv
from robosandbox.errors import InputError
from robosandbox.workcell.embedded import EmbeddedWorkcell


@pytest.fixture(scope="module")
def session() -> EmbeddedWorkcell:
    return open_session("home", seed=np.int64(0))  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("given", "told"),
    [
        ({"task": 3}, "task: 3 is of type int; give Task or Scene or Path or str or None"),
        ({"seed": "x"}, "seed: 'x' is of type str; give int"),
        ({"seed": 1.5}, "seed: 1.5 is of type float; give int"),
        ({"robot": 3}, "robot: 3 is of type int; give Path or str or None"),
        ({"planner": None}, "planner: None is of type NoneType; give str"),
        ({"tempo": 1}, "tempo: 1 is of type int; give str"),
        ({"max_replans": "3"}, "max_replans: '3' is of type str; give int"),
        ({"what_if": "no"}, "what_if: 'no' is of type str; give bool"),
        ({"render_size": 5}, "render_size: 5 is of type int; give tuple"),
        ({"render_size": (240,)}, "render_size: (240,) is not (height, width) in pixels"),
    ],
    ids=str,
)
def test_an_option_of_another_kind_is_named(given: dict[str, Any], told: str) -> None:
    with pytest.raises(InputError, match=re.escape(told)):
        open_session(**{"task": "home", **given})


def test_an_unknown_option_gets_a_suggestion() -> None:
    with pytest.raises(TypeError, match="open_session takes no 'percetion'; did you mean 'perception'"):
        open_session("home", percetion="rgbd")  # type: ignore[call-arg]


@pytest.mark.parametrize("prompt", [3, ["pick"]], ids=str)
def test_a_prompt_that_is_no_text_is_told(session: EmbeddedWorkcell, prompt: Any) -> None:
    with pytest.raises(InputError, match="is no text; give a sentence"):
        session.run(prompt)


def test_a_seed_that_is_no_whole_number_is_told(session: EmbeddedWorkcell) -> None:
    with pytest.raises(InputError, match="seed: 'x' is no whole number"):
        session.reset("x")  # type: ignore[arg-type]


def test_options_of_an_environments_reset_that_are_no_dict_are_told(session: EmbeddedWorkcell) -> None:
    env = ManipulationEnv(session)
    with pytest.raises(InputError, match="options: 5 is no dict"):
        env.reset(options=5)  # type: ignore[arg-type]
    with pytest.raises(InputError, match="seed: 'x' is no whole number"):
        env.reset(options={"layout": "x"})


def test_a_session_that_was_closed_says_so() -> None:
    with open_session("home") as closed:
        pass
    with pytest.raises(RuntimeError, match="what was closed stays closed"):
        closed.observe()
