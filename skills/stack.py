"""Stack: pick one object and put it on another."""

from __future__ import annotations

from robosandbox.errors import InvalidArgumentError, Phase
from robosandbox.protocols import SkillContext
from robosandbox.skills.base import Skill
from robosandbox.skills.pick import Pick
from robosandbox.skills.place_on import PlaceOn
from robosandbox.types import SkillResult


class Stack(Skill):
    """Pick one object and put it on another."""

    name = "stack"

    def run(self, ctx: SkillContext, *, object: str, target: str) -> SkillResult:
        """Pick an object and put it on top of another.

        Args:
            object: Id of the object to move.
            target: Id of the object to put it on.

        Raises:
            SkillError: As pick and place_on raise them.
        """
        if object == target:
            raise InvalidArgumentError(f"{self.name}: {object} cannot stand on itself", phase=Phase.CHECK)
        picked = Pick().run(ctx, object=object)
        placed = PlaceOn().run(ctx, target=target)
        effects = tuple(text for text in (*picked.side_effects, *placed.side_effects))
        return SkillResult(skill=self.name, detail=placed.detail, side_effects=effects)
