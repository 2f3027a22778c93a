"""Who but the sim can speak in its name: every role of every shipped configuration tries, on every key of the protocol.

    python benchmarks/forging.py [KIT ...] [--times 20] [--json]

Kits: default, password, tls, router, and open: a router that asks nobody and has no rules, as a control of the count itself.
A forgery counts when it reaches the operator or the observer, each with a plain Zenoh session that believes everything.
"""

from __future__ import annotations

import argparse
import importlib.util
import json
import sys
import tempfile
import threading
import uuid
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from itertools import groupby
from pathlib import Path

import zenoh
from support.kits import KITS, OPEN, Kit, running_kit
from support.processes import free_port

from robosandbox.workcell.zenoh.transport import open_connector

ROOT = Path(__file__).resolve().parents[1]
EXAMPLES = ROOT / "examples" / "zenoh"
MODES = ("peer", "client", "router")
MARK = b"forged"
# No message: the sim refuses it at once, and draws or moves nothing for it.
QUESTION = b"?"
# A format that no camera has.
UNDRAWN = "?format=none"
# Replies on the same key are otherwise merged into the one with the latest time stamp.
UNMERGED = zenoh.ConsolidationMode.NONE
TIMEOUT = 10.0


@dataclass(frozen=True)
class Row:
    """What one role in one mode achieved on one key.

    Attributes:
        kit: The configuration.
        role: Whose credentials the forger has.
        mode: Of the forger's Zenoh session.
        kind: What it tried.
        key: On which key of the protocol.
        forged: How many forgeries reached somebody.
        tried: Of how many.
    """

    kit: str
    role: str
    mode: str
    kind: str
    key: str
    forged: int
    tried: int


def protocol_keys() -> tuple[str, ...]:
    """Return the keys of docs/protocol.md, one for each pattern, and the one where late joiners ask for the last state."""
    spec = importlib.util.spec_from_file_location("make_protocol", ROOT / "docs" / "make_protocol.py")
    assert spec and spec.loader
    page = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(page)
    patterns = [pattern for pattern, *_ in page.KEYS]
    return (*patterns, "obs/state/@adv/pub/*/*/_")


def concrete(pattern: str, robot_id: str = "robot") -> str:
    """Return a key that a pattern of the protocol stands for."""
    skill = pattern.replace("skill/<name>", "skill/home").replace("camera/<name>", "camera/scene")
    return f"robosandbox/{robot_id}/" + skill.replace("<goal_id>", str(uuid.uuid4())).replace(
        "<client_id>", str(uuid.uuid4())
    )


@contextmanager
def forger(kit: Kit, role: str, mode: str) -> Iterator[zenoh.Session]:
    """Open a session with a role's credentials that does all it can to be met by others: it gossips, and a peer listens."""
    file = kit.config(role)
    config = zenoh.Config.from_file(str(file)) if file else zenoh.Config()
    settings = {
        "mode": mode,
        "scouting/multicast/enabled": False,
        "scouting/gossip/enabled": True,
        "listen/endpoints": [] if mode == "client" else [f"tcp/127.0.0.1:{free_port()}"],
        "connect/timeout_ms": round(1000 * TIMEOUT),
        "connect/exit_on_failure": True,
    }
    if kit.endpoints:
        settings["connect/endpoints"] = list(kit.endpoints)
    for path, value in settings.items():
        config.insert_json5(path, json.dumps(value))
    with zenoh.open(config) as session:
        meet(session)
        yield session


def meet(session: zenoh.Session) -> None:
    """Wait until a session sees the sim, whose token comes after all else that it declares.

    Raises:
        RuntimeError: It does not see it.
    """
    there = threading.Event()
    alive = session.liveliness().declare_subscriber("robosandbox/robot/alive", lambda _: there.set(), history=True)
    if not there.wait(TIMEOUT):
        raise RuntimeError("the sim is not seen")
    alive.undeclare()


def settle(session: zenoh.Session) -> None:
    """Return when all that a session has sent before has been dealt with: messages of a link keep their order.

    Raises:
        RuntimeError: The sim does not answer it.
    """
    if not list(session.get("robosandbox/robot/info", payload=QUESTION, timeout=TIMEOUT)):
        raise RuntimeError("the sim does not answer")


# The forgeries. Each returns whether it reached the victim.


def answer(forging: zenoh.Session, victim: zenoh.Session, key: str, *, complete: bool) -> bool:
    """Answer a question that the victim asks."""
    queryable = forging.declare_queryable(key, _forge_reply, complete=complete)
    settle(forging)
    settle(victim)
    got = []
    for target in (zenoh.QueryTarget.ALL, zenoh.QueryTarget.BEST_MATCHING):
        got += list(victim.get(key + UNDRAWN, payload=QUESTION, target=target, consolidation=UNMERGED, timeout=TIMEOUT))
    queryable.undeclare()
    return any(said.payload.to_bytes() == MARK for said in (reply.result for reply in got))


def _forge_reply(query: zenoh.Query) -> None:
    with query:
        query.reply(str(query.key_expr).replace("*", "x"), MARK)


def publication(forging: zenoh.Session, victim: zenoh.Session, key: str, *, delete: bool) -> bool:
    """Publish to a victim that listens."""
    if "*" in key:
        key = key.replace("*", "x")
    heard: list[zenoh.Sample] = []
    subscriber = victim.declare_subscriber(key, zenoh.handlers.FifoChannel(10_000))
    settle(victim)
    settle(forging)
    if delete:
        forging.delete(key, congestion_control=zenoh.CongestionControl.BLOCK)
    else:
        forging.put(key, MARK, congestion_control=zenoh.CongestionControl.BLOCK)
    settle(forging)
    settle(victim)
    while (sample := subscriber.try_recv()) is not None:
        heard.append(sample)
    subscriber.undeclare()
    return any(s.kind == zenoh.SampleKind.DELETE or s.payload.to_bytes() == MARK for s in heard)


def token(forging: zenoh.Session, victim: zenoh.Session, key: str) -> bool:
    """Declare a token before a victim that watches, which comes and goes."""
    # Another robot's: a token that the sim holds already is no news.
    key = key.replace("robosandbox/robot/", "robosandbox/another/").replace("*", "x")
    subscriber = victim.liveliness().declare_subscriber(key, zenoh.handlers.FifoChannel(100), history=True)
    settle(victim)
    declared = forging.liveliness().declare_token(key)
    settle(forging)
    settle(victim)
    seen = subscriber.try_recv() is not None
    asked = any(reply.ok for reply in victim.liveliness().get(key, timeout=TIMEOUT))
    declared.undeclare()
    subscriber.undeclare()
    return seen or asked


def departure(forging: zenoh.Session, victim: zenoh.Session, key: str) -> bool:
    """Declare the sim's own token, and take it back: for the victim the sim is gone."""
    key = key.replace("*", "x")
    subscriber = victim.liveliness().declare_subscriber(key, zenoh.handlers.FifoChannel(100), history=True)
    settle(victim)
    declared = forging.liveliness().declare_token(key)
    settle(forging)
    declared.undeclare()
    settle(forging)
    settle(victim)
    gone = False
    while (sample := subscriber.try_recv()) is not None:
        gone |= sample.kind == zenoh.SampleKind.DELETE
    subscriber.undeclare()
    return gone


Forgery = Callable[[zenoh.Session, zenoh.Session, str], bool]
FORGERIES: dict[str, Forgery] = {
    "answer": lambda forging, victim, key: answer(forging, victim, key, complete=False),
    "complete answer": lambda forging, victim, key: answer(forging, victim, key, complete=True),
    "publication": lambda forging, victim, key: publication(forging, victim, key, delete=False),
    "deletion": lambda forging, victim, key: publication(forging, victim, key, delete=True),
    "token": token,
    "departure": departure,
}


def attack(kit: Kit, role: str, mode: str, times: int) -> Iterator[Row]:
    """Try every forgery on every key, before an operator and an observer."""
    with ExitStack() as stack:
        victims = [
            stack.enter_context(open_connector(kit.endpoints, config_file=kit.config(name), timeout=TIMEOUT))
            for name in kit.roles
        ]
        for victim in victims:
            meet(victim)
        forging = stack.enter_context(forger(kit, role, mode))
        for kind, forge in FORGERIES.items():
            for pattern in protocol_keys():
                reached = [forge(forging, victim, concrete(pattern)) for victim in victims for _ in range(times)]
                yield Row(kit.name, role, mode, kind, pattern, sum(reached), len(reached))


def measure(names: Sequence[str], times: int) -> Iterator[Row]:
    """Run each kit and all attacks on it."""
    with tempfile.TemporaryDirectory() as folder:
        for name in names:
            with running_kit(name, EXAMPLES, Path(folder), options=("--task", "home", "--pace", "fast")) as kit:
                for role in kit.roles:
                    for mode in MODES:
                        yield from attack(kit, role, mode, times)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("kits", nargs="*", choices=[[], *KITS, OPEN], default=[])
    parser.add_argument("--times", type=int, default=20)
    parser.add_argument("--json", action="store_true")
    arguments = parser.parse_args()
    rows = measure(arguments.kits or KITS, arguments.times)
    if arguments.json:
        json.dump([row.__dict__ for row in rows], sys.stdout, indent=2)
        return
    print("| kit | role | mode | forgery | keys | forged | tried |\n|---|---|---|---|---|---|---|")
    for (kit, role, mode, kind), group in groupby(rows, lambda row: (row.kit, row.role, row.mode, row.kind)):
        same = list(group)
        reached = ", ".join(f"{row.key} {row.forged}" for row in same if row.forged)
        tried = sum(row.tried for row in same)
        print(f"| {kit} | {role} | {mode} | {kind} | {len(same)} | {reached or 0} | {tried} |", flush=True)


if __name__ == "__main__":
    main()
