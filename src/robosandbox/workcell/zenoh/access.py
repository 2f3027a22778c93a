"""Rights of each role at a sim or router, as rules of Zenoh's access control.

A rule allows kinds of message on keys in one direction: `ingress` is what the listener takes from a role, `egress` what it lets
through to it. The configurations in examples/zenoh/ hold the same rules, since a router reads files.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Final, Literal

from robosandbox.workcell.zenoh.messages import key

Rule = Mapping[str, Any]
Flow = Literal["ingress", "egress"]


def _keys(*suffixes: str) -> list[str]:
    return [key("*", suffix) for suffix in suffixes]


# Where late joiners ask for the last state; `**` does not stand for names that begin with an @.
_HISTORY: Final = "obs/**/@adv/**"
_LOOKING: Final = _keys("info", "obs/**", "skill/*/get_result", _HISTORY)
# Wider than the sim's keys: it is the sim that says what is wrong with a question.
_ANYTHING: Final = _keys("**", _HISTORY)
_NEWS: Final = _keys("obs/**", "goal/**")
_ALIVE: Final = _keys("alive")
_CLIENTS: Final = _keys("client/*")

_ASK: Final = ("query",)
_ANSWER: Final = ("declare_queryable", "reply")
_LISTEN: Final = ("declare_subscriber",)
_PUBLISH: Final = ("put",)
_WATCH: Final = ("liveliness_query", "declare_liveliness_subscriber")
_BE_SEEN: Final = ("liveliness_token",)


def _allow(name: str, flow: Flow, messages: Sequence[str], keys: Sequence[str]) -> Rule:
    return {"id": name, "permission": "allow", "flows": [flow], "messages": [*messages], "key_exprs": [*keys]}


OBSERVER: Final = (
    _allow("ask what is seen", "ingress", _ASK, _LOOKING),
    _allow("be answered what is seen", "egress", _ANSWER, _LOOKING),
    _allow("listen to news", "ingress", _LISTEN, _NEWS),
    _allow("hear news", "egress", _PUBLISH, _NEWS),
    _allow("look for sims", "ingress", _WATCH, _ALIVE),
    _allow("find sims", "egress", _BE_SEEN, _ALIVE),
)
OPERATOR: Final = (
    *OBSERVER,
    _allow("ask for anything", "ingress", _ASK, _ANYTHING),
    _allow("be answered on anything", "egress", _ANSWER, _ANYTHING),
    # A client's own presence: when it is lost, the sim cancels its goals.
    _allow("be present", "ingress", _BE_SEEN, _CLIENTS),
    _allow("be looked for", "egress", _WATCH, _CLIENTS),
)
# A sim that connects to a router, as the router sees it.
SIM: Final = (
    _allow("answer", "ingress", _ANSWER, _ANYTHING),
    _allow("be asked", "egress", _ASK, _ANYTHING),
    _allow("publish news", "ingress", _PUBLISH, _NEWS),
    _allow("be listened to", "egress", _LISTEN, _NEWS),
    # It asks for its own id first, which another sim may serve.
    _allow("be found", "ingress", (*_BE_SEEN, *_WATCH), _ALIVE),
    _allow("be searched for", "egress", (*_BE_SEEN, *_WATCH), _ALIVE),
    _allow("look for clients", "ingress", _WATCH, _CLIENTS),
    _allow("see clients", "egress", _BE_SEEN, _CLIENTS),
)


def rules_for_anyone() -> Mapping[str, Any]:
    """Return the access control of a sim that asks nobody who they are: whoever connects is an operator, and none is the sim."""
    return {
        "enabled": True,
        "default_permission": "deny",
        "rules": [*OPERATOR],
        # Without a name, certificate or interface a subject is everybody.
        "subjects": [{"id": "anyone"}],
        "policies": [{"subjects": ["anyone"], "rules": [rule["id"] for rule in OPERATOR]}],
    }
