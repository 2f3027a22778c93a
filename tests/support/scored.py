"""The benchmarks of language, imported from where they are."""

import sys
from pathlib import Path

# Behind everything else, so that no module of the benchmarks hides a package.
sys.path.append(str(Path(__file__).resolve().parents[2] / "benchmarks"))

import executed
import language
import libero_sentences
import sentences

__all__ = ["executed", "language", "libero_sentences", "sentences"]
