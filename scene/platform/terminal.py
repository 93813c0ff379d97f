"""The console that every command prints to: tables that fit the encoding, readers that may go away."""

from __future__ import annotations

from typing import Any

from rich.console import Console
from rich.text import Text


class Terminal(Console):
    """A rich console over standard output (results) or standard error (messages)."""

    def on_broken_pipe(self) -> None:
        """Stop printing messages when nobody reads them; rich would discard the results too.

        Raises: BrokenPipeError: the reader of the results went away.
        """
        self.quiet = True
        if not self.stderr:
            raise BrokenPipeError

    def render_str(self, text: str, **options: Any) -> Text:
        """Text as the stream will write it, so that columns are as wide as what stands in them."""
        return super().render_str(self._as_written(text), **options)

    def _as_written(self, text: str) -> str:
        errors = getattr(self.file, "errors", None) or "strict"
        if text.isascii() or errors in {"strict", "surrogateescape"}:
            return text
        return text.encode(self.encoding, errors).decode(self.encoding, "surrogateescape")


def results_console() -> Terminal:
    """Standard output, for results."""
    return Terminal()


def messages_console() -> Terminal:
    """Standard error, for progress and messages."""
    return Terminal(stderr=True)
