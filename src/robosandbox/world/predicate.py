"""Predicates, of which relations are made: a test on a scene, an effect, the failure without it, and remedies."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from typing import Any

from robosandbox.errors import InvalidArgumentError, Phase, SkillError
from robosandbox.types import DetectedObject, ObservedScene
from robosandbox.values import frozen
from robosandbox.world.abilities import Abilities
from robosandbox.world.facts import Fact

# Below this confidence what is told of an object is not sure; perceptions say 1 where they know.
_SURE = 0.5


@frozen(kw_only=True)
class View:
    """Scene, start and robot from which relations are told.

    Attributes:
        scene: What is where now.
        before: The same when the step began, for relations of change.
        robot: What the robot can do.
        slack: What placements are allowed to be off beside each relation's own tolerance, metres.
    """

    scene: ObservedScene
    before: ObservedScene
    robot: Abilities
    slack: float = 0.0

    @classmethod
    def of(cls, scene: ObservedScene, robot: Abilities | None = None) -> View:
        """Return the view of a scene in which no step has begun."""
        return cls(scene=scene, before=scene, robot=robot or Abilities.of(scene))

    def get(self, name: object) -> DetectedObject:
        """Return an object that is known to be seen.

        Raises:
            KeyError: It is not.
        """
        found = self.scene.find(str(name))
        if found is None:
            raise KeyError(name)
        return found

    def others(self, *names: object) -> list[DetectedObject]:
        """Return what is seen besides these and what is held."""
        left_out = {*names, *self.scene.in_hands}
        return [item for item in self.scene.objects if item.id not in left_out]


@frozen(kw_only=True)
class Finding:
    """Truth of a relation, its margin, and the cause where it does not hold.

    Attributes:
        holds: The answer.
        margin: By how much it holds, negative where it does not; None where there is nothing to measure.
        tolerance: What of that is allowed, in the same unit.
        is_sure: Whether what was seen settles it.
        cause: Why it does not hold, in a clause.
        help: What would make it hold, in a clause.
        blocking: Ids of what stands against it.
        remedies: Facts each of which would help, and after which it can be asked again.
    """

    holds: bool
    margin: float | None = None
    tolerance: float | None = None
    is_sure: bool = True
    cause: str = ""
    help: str = ""
    blocking: tuple[str, ...] = ()
    remedies: tuple[Fact, ...] = ()

    @property
    def is_refuted(self) -> bool:
        """True where it surely does not hold."""
        return self.is_sure and not self.holds


Test = Callable[..., Finding]
ApplyEffect = Callable[..., ObservedScene]
Choices = Callable[..., Iterator[tuple[float, ...]]]
Blame = Callable[[View, Sequence[Any], Finding], SkillError]


@frozen(kw_only=True)
class Predicate:
    """A relation by name.

    Attributes:
        name: As facts call it.
        parameters: What its arguments are: object, place (an object or "table"), number, word; those with a "?" may be left out.
        test: Tells it from a view and the arguments.
        effect: Returns the scene in which it was brought about; None for what no skill brings about.
        is_fixed: Whether nothing that the robot does changes it, as what an object is made for.
        lasts: Whether it is a state that can be looked at later, not a change.
        is_last: Whether it is brought about at last, since what other goals need would undo it.
        blame: Returns the error of a skill that needs it and does not have it.
        choices: Yields values for its last arguments with which it holds, the best first, where they are open.
        lost: Returns the error for it not being there, or no more, though it was brought about.
    """

    name: str
    parameters: tuple[str, ...]
    test: Test
    effect: ApplyEffect | None = None
    is_fixed: bool = False
    lasts: bool = False
    is_last: bool = False
    blame: Blame | None = None
    lost: Blame | None = None
    choices: Choices | None = None

    def objects(self, arguments: Sequence[Any]) -> list[str]:
        """Return the arguments that are ids of objects."""
        pairs = zip(self.parameters, arguments, strict=False)
        return [
            str(value)
            for kind, value in pairs
            if kind.rstrip("?") == "object" or (kind.rstrip("?") == "place" and value != "table")
        ]

    def error(self, view: View, arguments: Sequence[Any], finding: Finding) -> SkillError:
        """Return the error of a skill that needs this."""
        if self.blame is not None:
            return self.blame(view, arguments, finding)
        return InvalidArgumentError(sentence(finding), phase=Phase.CHECK)


@dataclass(slots=True)
class _Vocabulary:
    """All relations by name; filled when their modules are imported."""

    known: dict[str, Predicate] = field(default_factory=dict)
    is_whole: bool = False


_VOCABULARY = _Vocabulary()


def predicate(
    *parameters: str,
    effect: ApplyEffect | None = None,
    fixed: bool = False,
    lasts: bool = False,
    last: bool = False,
    blame: Blame | None = None,
    lost: Blame | None = None,
    choices: Choices | None = None,
) -> Callable[[Test], Test]:
    """Register a function as the test of the relation that is called like it."""

    def register(test: Test) -> Test:
        name = test.__name__.rstrip("_")
        _VOCABULARY.known[name] = Predicate(
            name=name,
            parameters=parameters,
            test=test,
            effect=effect,
            is_fixed=fixed,
            lasts=lasts,
            is_last=last,
            blame=blame,
            lost=lost,
            choices=choices,
        )
        return test

    return register


def predicates() -> dict[str, Predicate]:
    """Return all relations by name."""
    if not _VOCABULARY.is_whole:
        # Each module registers what it tells; they need this one.
        from robosandbox.world import changes, containers, hand, locations, parts, reach, rings, standing  # noqa: F401

        _VOCABULARY.is_whole = True
    return _VOCABULARY.known


def sentence(finding: Finding) -> str:
    """Return why a relation does not hold and what would help, in a sentence."""
    return f"{finding.cause}; {finding.help}" if finding.help else finding.cause


def is_clearly_seen(*items: DetectedObject) -> bool:
    """Tell whether perception is sure enough of these."""
    return all(item.confidence >= _SURE for item in items)
