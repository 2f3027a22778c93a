"""The form that orders are given with, as HTML: one element, whose buttons read its fields at the moment of the click."""

from __future__ import annotations

from collections.abc import Sequence
from html import escape

from robosandbox.apps.viewer.html import COLOURS
from robosandbox.apps.viewer.orders import SUBMIT
from robosandbox.types import MAX_PROMPT_LENGTH

_STYLE = f"""
.order {{ padding: 0 0.75em 0.4em; font-size: 0.875rem; }}
.order label {{ display: block; font-weight: 500; margin-bottom: 0.25em; }}
.order input {{ box-sizing: border-box; font: inherit; height: 2.3em; padding: 0 0.6em; color: #1b1f24; background: #fff;
  border: 1px solid #b6bec8; border-radius: 4px; min-width: 0; }}
.order input:focus {{ outline: 2px solid {COLOURS["blue"]}; outline-offset: -1px; }}
.order input[name=prompt] {{ width: 100%; }}
.order div {{ display: flex; flex-wrap: wrap; gap: 0.5em; margin-top: 0.5em; align-items: center; }}
.order button {{ font: inherit; height: 2.3em; padding: 0 0.9em; border-radius: 4px; cursor: pointer; white-space: nowrap;
  color: {COLOURS["ink"]}; background: #fff; border: 1px solid #b6bec8; }}
.order button:hover {{ background: #f1f3f6; }}
.order button:focus-visible {{ outline: 2px solid {COLOURS["blue"]}; outline-offset: 1px; }}
.order button[value=run] {{ flex: 2; font-weight: 600; color: #fff; background: {COLOURS["green"]}; border-color: {COLOURS["green"]}; }}
.order button[value=run]:hover {{ background: #196f3d; }}
.order button[value=stop], .order button[value=plan], .order button[value=check], .order button[value=simulate] {{ flex: 1; }}
.order div.more label {{ margin: 0 0 0 auto; font-weight: 400; color: {COLOURS["grey"]}; }}
.order input[name=seed] {{ width: 4.6em; }}
.order.answers {{ padding-bottom: 0.9em; }}
.order.answers div {{ margin-top: 0; }}
.order output {{ display: block; color: {COLOURS["red"]}; font-size: 0.92em; margin-top: 0.35em; }}
.order output:empty {{ display: none; }}
"""
# While something moves, Stop is what matters, and Run would only be refused.
_MOVING = f"""
.order button[value=stop] {{ color: #fff; background: {COLOURS["red"]}; border-color: {COLOURS["red"]}; font-weight: 700; flex: 2; }}
.order button[value=stop]:hover {{ background: #a51d1d; }}
.order button[value=run], .order button[value=run]:hover {{ color: {COLOURS["grey"]}; background: #fff; border-color: #d5dae0; flex: 1; }}
"""


def order_form(prompt: str) -> str:
    """Return the form; a browser that is shown it again loses what was typed, so it changes with the task only.

    Args:
        prompt: What the box says at first; escaped here.
    """
    return f"""<style>{_STYLE}</style>
<form class="order" autocomplete="off" onsubmit="{escape(SUBMIT)}">
<label for="prompt">Prompt</label>
<input id="prompt" name="prompt" value="{escape(prompt)}" maxlength="{MAX_PROMPT_LENGTH}" enterkeyhint="go"
  placeholder="What the robot should do">
<div><button name="do" value="run" title="Enter does the same">Run</button>
<button name="do" value="plan" title="Shows the plan and moves nothing">Plan</button>
<button name="do" value="check" title="Says what speaks against the plan and moves nothing">Check</button>
<button name="do" value="simulate" title="Tries the plan on the twin and moves nothing">Try</button>
<button name="do" value="stop" title="The arm holds where it is">Stop</button></div>
<div class="more"><button name="do" value="back" title="Back to before the last thing that changed the world">Step back</button>
<button name="do" value="recover" title="Ends a fault that has stopped the arm, once somebody has looked after it">Recover</button>
<button name="do" value="judge" title="Has the task succeeded since the last reset?">Judge</button>
<label for="seed">Seed</label><input id="seed" name="seed" type="number" value="0" min="0" step="1"
  title="The layout that Reset makes; 0 is the task as written">
<button name="do" value="reset" title="Starts over with the seed's layout">Reset</button></div>
<output></output></form>"""


def answer_form(answers: Sequence[str], do: str) -> str:
    """Return a form with a button for each answer to a question.

    Args:
        answers: What can be said; escaped here.
        do: What is asked for with the answer.
    """
    buttons = "".join(f'<button name="prompt" value="{escape(one)}">{escape(one)}</button>' for one in answers)
    return f"""<form class="order answers" onsubmit="{escape(SUBMIT)}"><input type="hidden" name="do" value="{do}">
<label>Answer here, in words, or with a click in the scene</label><div>{buttons}</div><output></output></form>"""


def mood(moving: bool) -> str:
    """Return the style that makes Stop loud while something moves. The form stays the same element, so no click is lost."""
    return f"<style>{_MOVING if moving else ''}</style>"
