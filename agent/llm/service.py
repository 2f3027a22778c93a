"""A conversation with a model over HTTP: retries with back-off, one deadline, a budget of tokens, typed errors."""

from __future__ import annotations

import asyncio
import json
import logging
import os
import time
from collections.abc import Coroutine, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextvars import copy_context
from types import TracebackType
from typing import Self, TypeVar

import httpx2
from pydantic_ai import exceptions as failures
from pydantic_ai.direct import model_request, model_request_stream
from pydantic_ai.messages import (
    BinaryContent,
    ModelMessage,
    ModelRequest,
    ModelResponse,
    TextPart,
    ThinkingPart,
    ToolCallPart,
    ToolReturnPart,
    UserPromptPart,
)
from pydantic_ai.models import Model, ModelRequestParameters
from pydantic_ai.settings import ModelSettings
from pydantic_ai.tools import ToolDefinition

from robosandbox.agent.llm.budget import Budget, price
from robosandbox.agent.llm.draft import AnswerStream
from robosandbox.agent.llm.endpoint_capabilities import EndpointKey, endpoint_cache
from robosandbox.agent.llm.modes import Mode
from robosandbox.agent.llm.settings import KEY_VARIABLES, LLMSettings
from robosandbox.agent.llm.transport import (
    AnswerTooLargeError,
    CassetteRecorder,
    NotStreamedError,
    Player,
    live_transport,
)
from robosandbox.agent.overheard import hearer
from robosandbox.agent.usage import Exchange, count_exchange
from robosandbox.errors import InputError, PlannerAnswerError, PlannerUnavailableError

_log = logging.getLogger(__name__)

_ANSWER_TOKENS = 8_000  # Number of tokens of one answer. Chosen far above a plan's, so that thoughts fit.
_CONNECT_SECONDS = 5.0  # Seconds until a server that does not answer counts as absent. Chosen.
# Seconds of a prompt's time that are told of once they are spent. Chosen: what nobody waits for.
_SPENT_SECONDS = 0.1
_TRANSIENT = (
    failures.ModelRateLimitError,
    failures.ModelUnavailableError,
    failures.ModelServerError,
    failures.ModelConnectionError,
)

OFFICIAL = {
    "openai": "https://api.openai.com/v1",
    "responses": "https://api.openai.com/v1",
    "anthropic": "https://api.anthropic.com",
}

AnswerT = TypeVar("AnswerT")


class ModeRefusedError(Exception):
    """The service, or the library that speaks to it, does not take a request in this mode."""


class Service:
    """A model where it is served, or a cassette in its place.

    Args:
        settings: Model, endpoint and limits.

    Attributes:
        settings: The same.
        endpoints: Capabilities of endpoints; what is learnt is added.

    Raises:
        InputError: A key is missing, or the cassette cannot be used.
    """

    def __init__(self, settings: LLMSettings) -> None:
        self.settings = settings
        self.endpoints = endpoint_cache(settings)
        cassette = settings.cassette
        self.player = Player(cassette) if cassette is not None and cassette.exists() else None
        if cassette is not None and not cassette.absolute().parent.is_dir():
            raise InputError(f"--cassette: the folder of {str(cassette)!r} does not exist; make it first")
        if self.player is None:
            find_key(settings, settings.base_url or "", needed=True)


class ModelConnection:
    """A connection to a model for one plan; an asynchronous context manager.

    Args:
        service: The model and its endpoint.
        budgets: What may be spent, and what has been.

    Raises:
        InputError: A key is missing.
        PlannerUnavailableError: The time is spent already.
    """

    def __init__(self, service: Service, budgets: Sequence[Budget]) -> None:
        self._settings = settings = service.settings
        self._budgets = tuple(budgets)
        self.endpoints = service.endpoints
        player = service.player
        self._replayed = player is not None
        self._url = (
            settings.base_url or os.environ.get("" if settings.service == "anthropic" else "OPENAI_BASE_URL") or ""
        )
        self._key = find_key(settings, self._url, needed=not self._replayed)
        for budget in self._budgets:
            budget.check(self._where)
        self._begun = time.monotonic()
        tightest = min(self._budgets, key=lambda budget: budget.left("seconds"))
        self._time = tightest.left("seconds")
        self._limit = tightest.limits.seconds or self._time
        self._fault: Exception | None = None
        transport: httpx2.AsyncBaseTransport
        if player is not None:
            transport = player
        else:
            transport = live_transport(self._url or OFFICIAL[settings.service], settings.max_answer_bytes)
            if settings.cassette is not None:
                transport = CassetteRecorder(transport, settings.cassette, [self._key] if self._key else [])
        timeout = httpx2.Timeout(self._time, connect=min(_CONNECT_SECONDS, self._time))
        self._client = httpx2.AsyncClient(transport=transport, timeout=timeout)
        self._model = speaking_model(settings, self._url, self._key or "no-key", self._client)

    async def __aenter__(self) -> Self:
        return self

    async def __aexit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        for budget in self._budgets:
            budget.add(seconds=time.monotonic() - self._begun)
        if not self._replayed:
            await self._client.aclose()

    @property
    def model(self) -> Model:
        """The model as the library knows it."""
        return self._model

    @property
    def endpoint_key(self) -> EndpointKey:
        """The model and its endpoint."""
        return self._settings.service, self._url or OFFICIAL[self._settings.service], self._settings.model

    async def ask(self, messages: Sequence[ModelMessage], tools: Sequence[ToolDefinition], mode: Mode) -> ModelResponse:
        """Return the model's answer.

        Args:
            messages: The conversation so far.
            tools: What may be answered with.
            mode: How the model is held to that.

        Raises:
            ModeRefusedError: The request is not taken in this mode.
            PlannerUnavailableError: There is none within the time and the attempts.
            PlannerAnswerError: It is too large, or the tokens are spent.
            InputError: The service calls the request wrong: the model's name, the key.
        """
        for budget in self._budgets:
            budget.check(self._where)
        for attempt in range(1, self._settings.attempts + 1):
            answer = await self._attempt(messages, mode, mode.parameters(tools))
            if isinstance(answer, ModelResponse):
                for budget in self._budgets:
                    budget.take(answer)
                return answer
            fault, asked = answer
            self._fault = fault
            _log.info("attempt %d at %s: %s", attempt, self._where, self._said(fault))
            if attempt == self._settings.attempts:
                raise PlannerUnavailableError(
                    f"{self._where}: no answer in {attempt} attempts: {self._said(fault)}; try again later, "
                    "or use --planner stub"
                )
            pause = self._settings.back_off * 2.0 ** (attempt - 1) if asked is None else max(asked, 0.0)
            if pause > self._left and not self._replayed:
                raise PlannerUnavailableError(
                    f"{self._where}: {self._said(fault)}; it asks to wait {pause:.0f} s and {self._left:.0f} s are left; "
                    "try again later"
                )
            await asyncio.sleep(0.0 if self._replayed else pause)
        raise AssertionError("the settings allow at least one attempt")

    async def _attempt(
        self, messages: Sequence[ModelMessage], mode: Mode, parameters: ModelRequestParameters
    ) -> ModelResponse | tuple[Exception, float | None]:
        """Return an answer, or what went wrong that may go right later, with the seconds that the service asks to wait."""
        try:
            return await self._request(messages, mode, parameters)
        except failures.UserError as error:
            # The library knows of some models what they do not take, and does not ask them.
            raise ModeRefusedError(f"{self._where} does not take the request: {error}") from None
        except failures.ModelAPIError as error:
            self._raise_if_final(error)
            return error, error.retry_after
        except AnswerTooLargeError as error:
            raise PlannerAnswerError(f"{self._where}: {error}; no plan needs that") from None
        except failures.ContentFilterError as error:
            raise PlannerAnswerError(f"{self._where}: the service filtered it: {self._said(error)}") from None
        except (failures.UnexpectedModelBehavior, ValueError, RecursionError) as error:
            self._raise_known_cause(error)
            return error, None

    @property
    def _left(self) -> float:
        return self._begun + self._time - time.monotonic()

    @property
    def _where(self) -> str:
        return f"{self._settings.model} at {self._url or OFFICIAL[self._settings.service]}"

    def _too_late(self) -> str:
        """Return what to say where the time ends before an answer does."""
        is_whole = self._limit - self._time < _SPENT_SECONDS
        within = f"{self._limit:.3g} s" if is_whole else f"the {self._time:.2g} s that were left of {self._limit:.3g} s"
        if self._fault is not None:
            return f"{self._where}: no answer within {within}: {self._said(self._fault)}; try again later, or use --planner stub"
        return f"{self._where}: no complete answer within {within}; try again, give a longer --time-limit, or use a faster model"

    async def _request(
        self, messages: Sequence[ModelMessage], mode: Mode, parameters: ModelRequestParameters
    ) -> ModelResponse:
        left = min(budget.left("tokens") for budget in self._budgets)
        settings = ModelSettings(max_tokens=int(min(_ANSWER_TOKENS, left)))
        if self._url:
            # Local servers sample unless told not to; the vendors' reasoning models refuse to be told.
            settings["temperature"] = 0.0
        begun = time.monotonic()
        response: ModelResponse | None = None
        try:
            async with asyncio.timeout(max(self._left, 0.001)):
                response = await self._response(list(messages), settings, parameters)
            return response
        except TimeoutError:
            raise PlannerUnavailableError(self._too_late()) from None
        finally:
            usage = None if response is None else response.usage
            count_exchange(
                Exchange(
                    asked=_asked_in(messages),
                    answered="" if response is None else _answered_in(response),
                    mode=mode.value,
                    input_tokens=usage.input_tokens if usage else 0,
                    output_tokens=usage.output_tokens if usage else 0,
                    cost=0.0 if response is None else price(response),
                    seconds=time.monotonic() - begun,
                )
            )

    async def _response(
        self, messages: list[ModelMessage], settings: ModelSettings, parameters: ModelRequestParameters
    ) -> ModelResponse:
        """Return the answer to one request; it comes piece by piece where somebody listens and the server can do that."""
        listens, streams = hearer(), self.endpoints.of(self.endpoint_key).streams
        if listens is not None and streams is not False and self._settings.cassette is None:
            draft = AnswerStream(listens)
            try:
                async with model_request_stream(
                    self._model, messages, model_settings=settings, model_request_parameters=parameters
                ) as stream:
                    async for _ in stream:
                        if draft.due:
                            draft.show(stream.get(), whole=False)
                    response = stream.get()
            except (failures.ModelAPIError, NotStreamedError) as error:
                # A server that knows streams may refuse a request for its form, and says so in either way.
                if not _is_refused(error) or streams:
                    raise
            else:
                self.endpoints.learn(self.endpoint_key, streams=True)
                draft.show(response, whole=True)
                return response
        response = await model_request(
            self._model, messages, model_settings=settings, model_request_parameters=parameters
        )
        if listens is not None and streams is None and self._settings.cassette is None:
            self.endpoints.learn(self.endpoint_key, streams=False)
        return response

    def _raise_if_final(self, error: failures.ModelAPIError) -> None:
        """Raise what waiting cannot help."""
        self._raise_known_cause(error)
        said = self._said(error)
        if isinstance(error, failures.ModelAuthenticationError):
            variable = KEY_VARIABLES[self._settings.service]
            raise InputError(f"{variable}: {self._where} does not accept the key: {said}; set another") from None
        if isinstance(error, failures.ModelNotFoundError):
            raise InputError(f"--model: {self._where} is not there: {said}; check --model and --base-url") from None
        if isinstance(error, failures.ModelContextWindowExceededError):
            raise PlannerAnswerError(f"{self._where}: {said}; serve the model with a larger context") from None
        if isinstance(error, failures.ModelRequestRejectedError):
            raise ModeRefusedError(f"{self._where} does not take the request: {said}") from None
        if isinstance(error, failures.ModelQuotaExceededError):
            raise PlannerUnavailableError(f"{self._where}: {said}; its quota is spent") from None
        if isinstance(error, failures.ModelHTTPError) and not isinstance(error, _TRANSIENT):
            raise PlannerUnavailableError(f"{self._where}: {said}") from None

    def _raise_known_cause(self, error: BaseException) -> None:
        """Raise what this package's own transports said below the libraries that wrap it."""
        for cause in _causes(error):
            if isinstance(cause, InputError):
                raise cause
            if isinstance(cause, AnswerTooLargeError):
                raise PlannerAnswerError(f"{self._where}: {cause}; no plan needs that") from None

    def _said(self, error: Exception) -> str:
        """Return a failure in a line, without the key."""
        if isinstance(error, failures.ModelHTTPError):
            text = f"HTTP {error.status_code}: {_told(error.body)}"
        elif isinstance(error, failures.ModelAPIError):
            cause = error.__cause__
            inner = cause.__cause__ if cause is not None and cause.__cause__ is not None else cause
            is_new = inner is not None and str(inner) and str(inner) not in error.message
            text = f"{error.message} ({inner})" if is_new else error.message
        else:
            text = f"an answer that cannot be read ({' '.join(str(error).split())[:200]})"
        return clean(text, self._key)


def find_key(settings: LLMSettings, url: str, *, needed: bool) -> str | None:
    """Return the key from the environment.

    Raises:
        InputError: There is none and the service's own endpoint needs one.
    """
    variable = KEY_VARIABLES[settings.service]
    key = os.environ.get(variable, "").strip() or None
    if key is None and needed and not url:
        raise InputError(f"{variable}: is not set; set it to your key, or give --base-url for a server that needs none")
    return key


def speaking_model(settings: LLMSettings, url: str, key: str, client: httpx2.AsyncClient) -> Model:
    """Return a model that speaks its service's protocol over a client; retries are left to whoever asks it."""
    if settings.service == "anthropic":
        from anthropic import AsyncAnthropic
        from pydantic_ai.models.anthropic import AnthropicModel
        from pydantic_ai.providers.anthropic import AnthropicProvider

        speaker = AsyncAnthropic(api_key=key, base_url=url or None, max_retries=0, http_client=client)
        return AnthropicModel(settings.model, provider=AnthropicProvider(anthropic_client=speaker))
    from openai import AsyncOpenAI
    from pydantic_ai.models.openai import OpenAIChatModel, OpenAIResponsesModel
    from pydantic_ai.providers.openai import OpenAIProvider
    from pydantic_ai.providers.openai_compatible import OpenAICompatibleProvider

    caller = AsyncOpenAI(api_key=key, base_url=url or OFFICIAL["openai"], max_retries=0, http_client=client)
    kind = OpenAIResponsesModel if settings.service == "responses" else OpenAIChatModel
    if url:
        return kind(settings.model, provider=OpenAICompatibleProvider("openai-compatible", openai_client=caller))
    return kind(settings.model, provider=OpenAIProvider(openai_client=caller))


def run_apart(work: Coroutine[None, None, AnswerT]) -> AnswerT:
    """Run a coroutine to its end, also where a loop runs already, as in a notebook."""
    try:
        asyncio.get_running_loop()
    except RuntimeError:
        return asyncio.run(work)
    # The copied context lets whoever counts model usage here see what is asked there.
    with ThreadPoolExecutor(max_workers=1) as pool:
        return pool.submit(copy_context().run, asyncio.run, work).result()


def clean(text: str, key: str | None) -> str:
    """Return a text in one short line, without the key."""
    line = " ".join(text.split())
    return (line.replace(key, "***") if key else line)[:400]


def _told(body: object) -> str:
    """Return the message in an error's body."""
    inner = body.get("error", body) if isinstance(body, dict) else body
    message = inner.get("message", inner) if isinstance(inner, dict) else inner
    return str(message) if message else "no reason given"


def _is_refused(error: Exception) -> bool:
    """Say whether a server does not take a request as it is, or does not answer it piece by piece."""
    return isinstance(error, failures.ModelRequestRejectedError) or any(
        isinstance(cause, NotStreamedError) for cause in _causes(error)
    )


def _causes(error: BaseException) -> Iterator[BaseException]:
    """Yield an error and what it came from, the outermost first."""
    cause: BaseException | None = error
    while cause is not None:
        yield cause
        cause = cause.__cause__ or cause.__context__


def _asked_in(messages: Sequence[ModelMessage]) -> str:
    """Return what is new in a conversation: its last request, without the instructions that every request repeats."""
    newest = next(message for message in reversed(messages) if isinstance(message, ModelRequest))
    texts = []
    for part in newest.parts:
        if isinstance(part, UserPromptPart):
            content = [part.content] if isinstance(part.content, str) else part.content
            texts += [
                item if isinstance(item, str) else f"({item.media_type})" if isinstance(item, BinaryContent) else ""
                for item in content
            ]
        elif isinstance(part, ToolReturnPart):
            texts.append(part.content if isinstance(part.content, str) else json.dumps(part.content, default=str))
    return "\n\n".join(text for text in texts if text)


def _answered_in(response: ModelResponse) -> str:
    """Return an answer: its text as it is, calls as JSON, thoughts between marks."""
    texts = []
    for part in response.parts:
        if isinstance(part, TextPart):
            texts.append(part.content)
        elif isinstance(part, ThinkingPart):
            texts.append(f"<think>{part.content}</think>")
        elif isinstance(part, ToolCallPart):
            texts.append(json.dumps({"name": part.tool_name, "arguments": part.args}))
    return "\n".join(text for text in texts if text)
