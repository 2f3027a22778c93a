"""What every skill shares: a name, a schema from its signature, checked arguments."""

from __future__ import annotations

import inspect
import re
from collections.abc import Mapping
from functools import cached_property
from typing import Any, ClassVar, get_type_hints

from pydantic import BaseModel, ConfigDict, Field, ValidationError, create_model

from robosandbox.errors import InvalidArgumentError, Phase, SkillError
from robosandbox.protocols import SkillContext
from robosandbox.types import SkillCall, SkillResult

_ARGUMENT = re.compile(r"^\s+(\w+): (.+)$")


class Skill:
    """One verb.

    A subclass sets `name` and writes `run(self, ctx, *, argument: type, ...) -> SkillResult`. The first line of run's
    docstring describes the skill and its `Args:` section the arguments; with the annotations they make the JSON schema.
    """

    name: ClassVar[str]
    run: Any

    @cached_property
    def description(self) -> str:
        """The first line of run's docstring."""
        return (inspect.getdoc(type(self).run) or "").partition("\n")[0]

    @property
    def schema(self) -> Mapping[str, Any]:
        """JSON schema of the arguments."""
        return self._arguments.model_json_schema()

    def __call__(self, ctx: SkillContext, arguments: Mapping[str, Any]) -> SkillResult:
        """Check the arguments and run.

        Raises:
            SkillError: The arguments are wrong, or the post-condition was not reached.
        """
        checked = self.check(arguments)
        try:
            result: SkillResult = self.run(ctx, **checked)
        except SkillError as error:
            if not error.repairs:
                error.repairs = ctx.repairs_for(SkillCall(skill=self.name, arguments=checked), error)
            error.append(ctx.advice_for(error))
            raise
        return result

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
