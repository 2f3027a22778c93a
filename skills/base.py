"""What every skill shares: a name, a schema from its signature, checked arguments."""

from __future__ import annotations

import inspect
import re
from collections.abc import Mapping
from functools import cached_property
from typing import Any, ClassVar, get_type_hints

from pydantic import BaseModel, ConfigDict, Field, ValidationError, create_model

from robosandbox.errors import InvalidArgumentError, Phase, SkillError
from robosandbox.skills.primitives.abilities import GripperAbilities
from robosandbox.skills.protocols import SkillContext
from robosandbox.skills.words import Words
from robosandbox.types import ObservedScene, SkillCall, SkillResult
from robosandbox.world.alternatives import Failure
from robosandbox.world.contracts import Contract, contract_of, error_for, first_refuted, lost
from robosandbox.world.predicate import View
from robosandbox.world.side_effects import disturbed

_ARGUMENT = re.compile(r"^\s+(\w+): (.+)$")


class Skill:
    """One verb.

    A subclass sets `name` and writes `run(self, ctx, *, argument: type, ...) -> SkillResult`. The first line of run's
    docstring describes the skill and its `Args:` section the arguments; with the annotations they make the JSON schema.

    It says what it does in `contract(self, *, argument: type, ...) -> Contract`, with the arguments of `run`: what is needed
    is refused before anything moves, what is promised is looked at afterwards, and plans are checked by it. Where a call of
    it may be mended in ways that the contract does not tell, it says which in
    `alternatives(self, failure, *, argument: type, ...) -> Iterable[Alternative]`.

    Attributes:
        name: As calls name it.
        words: What makes it sayable; None for what the grammar knows by itself or programs alone call.
        translations: The same in languages that are data: lines of a lexicon and of rules, by language.
    """

    name: ClassVar[str]
    run: Any
    contract: Any = None
    alternatives: Any = None
    words: ClassVar[Words | None] = None
    translations: ClassVar[Mapping[str, str]] = {}

    @cached_property
    def description(self) -> str:
        """The first line of run's docstring."""
        return (inspect.getdoc(type(self).run) or "").partition("\n")[0]

    @cached_property
    def schema(self) -> Mapping[str, Any]:
        """JSON schema of the arguments."""
        return self._arguments.model_json_schema()

    def __call__(self, ctx: SkillContext, arguments: Mapping[str, Any]) -> SkillResult:
        """Check arguments and limits, and run; whoever calls a skill calls it here.

        Raises:
            SkillError: The arguments are wrong, a limit forbids the call, or the post-condition was not reached.
        """
        checked = self.check(arguments)
        call = SkillCall(skill=self.name, arguments=checked)
        ctx.permit(call)
        before = ctx.look()
        contract = (contract_of(self, checked) or Contract()).resolved(before)
        try:
            return self._kept(ctx, checked, contract, before)
        except SkillError as error:
            ctx.doubt()
            if not error.repairs and ctx.what_if:
                error.repairs = ctx.repairs_for(
                    Failure(call=call, error=error, contract=contract, before=before, scene=ctx.look())
                )
            error.append(ctx.advice_for(error))
            raise

    def _kept(
        self, ctx: SkillContext, arguments: dict[str, Any], contract: Contract, before: ObservedScene
    ) -> SkillResult:
        """Run with checked arguments, and hold the skill to its contract.

        Raises:
            SkillError: What it needs does not hold, it failed, or what it promises is not seen.
        """
        if not contract.gives:
            unsaid: SkillResult = self.run(ctx, **arguments)
            return unsaid
        robot = GripperAbilities(ctx)
        _require(contract, View.of(before, robot))
        result: SkillResult = self.run(ctx, **arguments)
        after = ctx.look()
        seen = View(scene=after, before=before, robot=robot)
        broken = first_refuted(contract.gives, seen)
        if broken is not None:
            raise lost(*broken, seen, by=self.name)
        moved = disturbed(before, after, *contract.moves, *([before.held] if before.held else []))
        return result.model_copy(update={"side_effects": (*result.side_effects, *moved)})

    def require(self, ctx: SkillContext, scene: ObservedScene, **arguments: Any) -> None:
        """Check what the skill needs once more, in a scene that changed after it was called.

        Raises:
            SkillError: Something that it needs no longer holds.
        """
        contract = contract_of(self, arguments)
        if contract is not None:
            _require(contract.resolved(scene), View.of(scene, GripperAbilities(ctx)))

    def check(self, arguments: Mapping[str, Any]) -> dict[str, Any]:
        """Return the arguments by keyword, converted to their types.

        Raises:
            InvalidArgumentError: One is missing, unknown, of the wrong type, not finite, or out of range.
        """
        try:
            model = self._arguments.model_validate(dict(arguments))
        except ValidationError as error:
            problem = error.errors()[0]
            where = ".".join(str(part) for part in problem["loc"]) or "arguments"
            takes = ", ".join(self._arguments.model_fields) or "no arguments"
            raise InvalidArgumentError(
                f"{self.name}: {where}: {problem['msg']} (got {problem['input']!r:.80}); {self.name} takes {takes}",
                phase=Phase.CHECK,
            ) from None
        return {name: getattr(model, name) for name in self._arguments.model_fields}

    @cached_property
    def _arguments(self) -> type[BaseModel]:
        run = type(self).run
        hints = get_type_hints(run, include_extras=True)
        lines = (inspect.getdoc(run) or "").splitlines()
        described = {match[1]: match[2] for line in lines if (match := _ARGUMENT.match(line))}
        fields: dict[str, Any] = {}
        for parameter in inspect.signature(run).parameters.values():
            if parameter.kind is not inspect.Parameter.KEYWORD_ONLY:
                continue
            default = ... if parameter.default is inspect.Parameter.empty else parameter.default
            fields[parameter.name] = (
                hints[parameter.name],
                Field(default, description=described.get(parameter.name)),
            )
        config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False, strict=False)
        return create_model(f"{type(self).__name__}Arguments", __config__=config, **fields)


def _require(contract: Contract, view: View) -> None:
    lacking = first_refuted(contract.needs, view)
    if lacking is not None:
        raise error_for(*lacking, view)
