"""The vendors' libraries: where their services are, which key they take, and a model made to speak to one."""

from __future__ import annotations

import os

import httpx2
from pydantic_ai.models import Model

from robosandbox.agent.llm.settings import KEY_VARIABLES, LLMSettings
from robosandbox.errors import InputError

OFFICIAL = {
    "openai": "https://api.openai.com/v1",
    "responses": "https://api.openai.com/v1",
    "anthropic": "https://api.anthropic.com",
}


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
