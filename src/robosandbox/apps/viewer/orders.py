"""Orders from the page: one message each, which carries the text and the numbers that it is about.

Viser sends what is typed and what is clicked as separate messages, through one queue that keeps only the latest of those that come
within 50 ms. A click right after a key stroke therefore arrives without the last letters. An order here is a websocket message of
its own, filled from what the form shows at the moment of the click, so there is nothing that it could overtake.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Annotated, ClassVar, Literal

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from robosandbox.apps.viewer.control import Control
from robosandbox.apps.viewer.news import Complaint
from robosandbox.types import MAX_PROMPT_LENGTH

PATH = "/order"
# Seeds of NumPy's generators are not negative; JavaScript's numbers are exact up to here.
_MAX_SEED = 2**53 - 1

# The `onsubmit` of a form: fields and the button that was pressed, by their names, say what to do and with what. Orders from one page are sent one after another, so that Stop never passes the Run before it.
SUBMIT = """
event.preventDefault();
const order = JSON.stringify({...Object.fromEntries(new FormData(this)), [event.submitter.name]: event.submitter.value});
const answer = this.querySelector('output');
window.orders = (window.orders ?? Promise.resolve()).then(() => new Promise(done => {
  const line = new WebSocket(location.origin.replace('http', 'ws') + '/order');
  line.onopen = () => line.send(order);
  line.onmessage = ({data}) => { answer.textContent = data; };
  line.onerror = () => { answer.textContent = 'no answer: has the viewer been stopped?'; };
  line.onclose = done;
}));
"""


class PageOrder(BaseModel):
    """Order given by a button.

    Attributes:
        do: Which button.
        prompt: The sentence as the page shows it.
        seed: The layout that Reset makes.
    """

    model_config: ClassVar[ConfigDict] = ConfigDict(frozen=True, extra="forbid")

    do: Literal["run", "plan", "check", "simulate", "judge", "stop", "recover", "reset", "back"]
    prompt: Annotated[str, Field(max_length=MAX_PROMPT_LENGTH)] = ""
    seed: Annotated[int, Field(ge=0, le=_MAX_SEED)] = 0


# Takes a message from a page; returns what is wrong with it, or nothing.
TakeOrder = Callable[[str | bytes], str]


def taker(control: Control) -> TakeOrder:
    """Return a function that has orders carried out."""

    def take(message: str | bytes) -> str:
        try:
            order = PageOrder.model_validate_json(message)
        except ValidationError as error:
            first = error.errors(include_url=False)[0]
            return f"{'.'.join(map(str, first['loc'])) or 'order'}: {first['msg']}"
        obey(order, control)
        return ""

    return take


def obey(order: PageOrder, control: Control) -> None:
    """Have an order carried out; what cannot be done is told as a complaint."""
    prompt = order.prompt.strip()
    match order.do:
        case "stop":
            control.stop()
        case "reset":
            control.reset(order.seed)
        case "back":
            control.back()
        case "judge":
            control.judge()
        case "recover":
            control.recover()
        case "run" | "plan" | "check" | "simulate" if not prompt:
            control.tell(Complaint("the prompt is empty: say what the robot should do"))
        case "run":
            control.run(prompt)
        case "plan":
            control.plan(prompt)
        case "check" | "simulate" as then:
            control.plan(prompt, then)
