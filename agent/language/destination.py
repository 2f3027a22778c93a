"""Where one command sends things: a place, or a chain of them."""

from __future__ import annotations

from collections.abc import Sequence

from robosandbox.agent.language.intent import IT, At, Command, Place, Ref, Region, Relation, Table, Verb, replace


def placed(verb: Verb, objects: tuple[Ref, ...], places: Sequence[Place]) -> list[Command]:
    """A destination, or a chain of them: "red on green on blue"."""
    first, *chain = places
    if isinstance(first, Relation):
        if first.kind in ("held", "towards", "away", "against", "from"):
            return []
        if first.kind == "beside" and len(chain) == 1 and isinstance(chain[0], Relation) and chain[0].refs == (IT,):
            # "next to the ball, on its left"
            return [Command(verb, objects, replace(chain[0], refs=first.refs))]
        side = chain[0].sides if len(chain) == 1 and isinstance(chain[0], Region) and chain[0].name == "side" else ()
        if first.kind == "beside" and len(side) == 1:
            # "next to the ball, on the left"
            kind = {"near": "front", "far": "back"}.get(side[0], side[0])
            return [Command(verb, objects, replace(first, kind=kind))]
        supports: list[Ref] = []
        for support in chain:
            if not isinstance(support, Relation) or support.kind != "on" or not support.refs or first.kind != "on":
                return []
            supports += support.refs
        return [Command(verb, objects, first, tuple(supports))]
    if chain:
        # "in the corner on the left", "on the table next to the bin": the second says it closer.
        if isinstance(first, Table) and len(chain) == 1 and isinstance(chain[0], Relation | At | Region):
            return placed(verb, objects, chain)
        return []
    return [Command(verb, objects, first)]
