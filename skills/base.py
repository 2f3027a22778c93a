"""Base of all skills: a name, a schema from the signature of `run`, checked arguments."""

from __future__ import annotations

import inspect
import re
from collections.abc import Iterable, Mapping
from functools import cached_property
from typing import Any, ClassVar, get_type_hints

from pydantic import BaseModel, ConfigDict, Field, ValidationError, create_model

from robosandbox.errors import InvalidArgumentError, Phase
from robosandbox.skills.words import Words
from robosandbox.world.alternatives import Alternative, FailedCall
from robosandbox.world.contracts import Contract

_ARGUMENT = re.compile(r"^\s+(\w+): (.+)$")


class Skill:
    """One verb.

    A subclass sets `name` and writes `run(self, ctx, *, argument: type, ...) -> SkillResult`. The first line of run's
    docstring describes the skill and its `Args:` section the arguments; with the annotations they make the JSON schema.

    It says what it does in `contract(self, *, argument: type, ...) -> Contract`, with the arguments of `run`: what is needed
    is refused before anything moves, what is promised is looked at afterwards, and plans are checked by it. Where a call of
    it may be mended in ways that the contract does not tell, it says which in
    `alternatives(self, failure, *, argument: type, ...) -> Iterable[Alternative]`. `Executor` is what runs it.

    Attributes:
        name: As calls name it.
        words: What makes it sayable, several where verbs differ in what may follow; None for what the grammar knows by itself or programs alone call.
        translations: The same in languages that are data: lines of a lexicon and of rules, by language.
    """

    name: str
    run: Any
    words: ClassVar[Words | tuple[Words, ...] | None] = None
    translations: ClassVar[Mapping[str, str]] = {}

    @property
    def description(self) -> str:
        """The first line of run's docstring."""
        return (inspect.getdoc(type(self).run) or "").partition("\n")[0]

    @property
    def schema(self) -> Mapping[str, Any]:
        """JSON schema of the arguments."""
        return self._schema

    @cached_property
    def _schema(self) -> Mapping[str, Any]:
        return self._arguments.model_json_schema()

    def contract(self, *args: Any, **arguments: Any) -> Contract:
        """Return what a call needs and brings about; a skill that does not say promises nothing."""
        del args, arguments
        return Contract()

    def alternatives(self, failed: FailedCall, *args: Any, **arguments: Any) -> Iterable[Alternative]:
        """Return ways around a failed call that its contract does not tell; none, if the skill does not say."""
        del failed, args, arguments
        return ()

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
