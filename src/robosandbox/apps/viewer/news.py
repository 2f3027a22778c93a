"""News that the panels and layers of the page are told: what begins, what came of it, and how the world changed."""

from __future__ import annotations

from enum import StrEnum

from robosandbox.agent.episode import AgentEvent
from robosandbox.types import Refusal, RefusalCode
from robosandbox.values import frozen
from robosandbox.workcell.orders import BoundOrder, OrderResult


class Doing(StrEnum):
    """Activity that is under way."""

    NOTHING = "nothing"
    PLANNING = "planning"
    TRYING = "trying"
    RUNNING = "running"
    JUDGING = "judging"
    MOVING = "moving"
    LOADING = "loading"
    RECOVERING = "recovering"


@frozen
class Began:
    """Something is under way now; `what` says it in words."""

    doing: Doing
    what: str


@frozen
class Idle:
    """Nothing is under way any more; `ways_back` is how often Step back can be used."""

    ways_back: int


@frozen
class Came:
    """What came of an order."""

    order: BoundOrder
    result: OrderResult

    @property
    def refusal(self) -> Refusal | None:
        """The planner's no, if it said no."""
        refused = self.result.data.get("refusal")
        return Refusal.model_validate(refused) if refused else None

    @property
    def question(self) -> Refusal | None:
        """The planner's no where it is a question, which the next sentence answers."""
        return self.refusal if self.refusal is not None and is_question(self.refusal) else None


@frozen
class Stopped:
    """What was under way, and is no order, was stopped."""


@frozen
class Went:
    """The world was put into another state: `how` says by what."""

    how: str


@frozen
class Loaded:
    """There is another world."""


@frozen
class Complaint:
    """Something could not be done, for the reason in `message`."""

    message: str


@frozen
class Presence:
    """The process that has the world went away, which `away` says in words, or is back, and `away` is empty."""

    away: str


News = Began | Idle | Came | Stopped | Went | Loaded | Complaint | Presence | AgentEvent


def is_question(refusal: Refusal) -> bool:
    """Tell whether the planner asks something, which the next sentence answers."""
    return refusal.code is RefusalCode.AMBIGUOUS
