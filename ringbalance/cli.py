"""The command line: parser of the commands, and exit codes.

A command's module is imported only when the command runs, so that `--help` loads nothing from numpy down.
Results go to standard output, everything else to standard error.
"""

from __future__ import annotations

import atexit
import difflib
import gc
import os
import shlex
import sys
import traceback
from collections.abc import Callable, Sequence
from contextlib import suppress
from functools import partial
from inspect import Parameter as SignatureParameter
from inspect import Signature, signature
from pathlib import Path
from typing import Annotated, Any, get_args

from cyclopts import (
    App,
    CycloptsError,
    Group,
    MissingArgumentError,
    Parameter,
    Token,
    UnknownCommandError,
    convert,
)

import ringbalance
from ringbalance.commands import COMMANDS, EXAMPLE_SCENES, ShellCommand
from ringbalance.scene.platform.display import LOG, displayed
from ringbalance.scene.platform.memory import seldom_collected
from ringbalance.scene.registry import registered
from ringbalance.signals import interrupts
from ringbalance.streams import discard_unwritten, drop_unusable_size, interpreter_error, prepare_streams

DONE = 0
BAD_INPUT = 2
INTERRUPTED = 130
BROKEN_PIPE = 141

_EVERYWHERE = Parameter(group=Group("Options of every command", sort_key=100), show_default=False)


THREAD_COUNTS = (
    "OPENBLAS_NUM_THREADS",
    "OMP_NUM_THREADS",
    "MKL_NUM_THREADS",
    "BLIS_NUM_THREADS",
    "VECLIB_MAXIMUM_THREADS",
    "NUMEXPR_NUM_THREADS",
)


def _converted(hint: Any, tokens: Sequence[Token]) -> Any:
    """Convert as cyclopts does, but refuse a decimal for an integer and a file's path ending in a slash."""
    kinds = {hint, *get_args(hint)}
    for text in (token.value for token in tokens):
        if int in kinds and "." in text:
            raise ValueError(f"{text} is not a whole number.")
        if Path in kinds and any(character < " " for character in text):
            raise ValueError(f"{text!r} holds a control character.")
        if Path in kinds and text.endswith(("/", os.sep)) and Path(text).is_file():
            raise ValueError(f"{text} is a file, not a folder; leave out the last {text[-1]}.")
    return convert(hint, tokens)


def _build_app() -> App:
    """The application with its commands, none of them imported yet."""
    app = App(
        name="ringbalance",
        help="Are the closed formulas of a liquid-ring rotor balancer to be trusted, for your disc?",
        help_epilogue=(
            "ringbalance COMMAND --help has the options, an example and the exit codes of a command; "
            "ringbalance --install-completion lets the shell complete names of commands and options. "
            "Begin with: ringbalance report liquid_ring_paper; an unknown name lists the bundled scenes."
        ),
        version=ringbalance.__version__,
        # Markdown would load a parser and a highlighter, half the time of `--help`.
        help_format="plaintext",
        default_parameter=Parameter(negative=(), converter=_converted),
        result_action="return_value",
        suppress_keyboard_interrupt=False,
    )
    for name, command in COMMANDS.items():
        function = _shell_function(name, command)
        app.command(function, name=name, help=command.summary, help_epilogue=command.epilogue(name))
    app.register_install_completion_command(
        help="Let this shell (bash, zsh or fish) complete names of commands and options.", help_epilogue=""
    )
    app.meta.suppress_keyboard_interrupt = False
    app.meta.default(partial(_dispatch, app))
    return app


def _shell_function(name: str, command: ShellCommand) -> Callable[..., int]:
    """The function from whose signature and docstring the shell's parser and `--help` of a command come."""

    def run(*arguments: Any, **options: Any) -> int:
        result: int = registered("function", "run_command")(
            name, **shape.bind(*arguments, **options).arguments
        )
        return result

    text = command.text.replace("`", "")
    hints: dict[str, Any] = {}
    parameters = []
    for key, option in command.options.items():
        documented = not option.text or f"    {key}: " in command.text
        help_text = {} if documented else {"help": option.text.replace("`", "")}
        hints[key] = Annotated[option.hint, Parameter(**{**option.parsing, **help_text})]
        several = option.kind is SignatureParameter.VAR_POSITIONAL
        default = SignatureParameter.empty if several else option.default
        parameters.append(SignatureParameter(key, option.kind, default=default, annotation=hints[key]))
    shape = Signature(parameters)
    run.__signature__, run.__annotations__, run.__doc__ = shape, hints, text  # type: ignore[attr-defined]
    return run


def _dispatch(
    app: App,
    /,
    *tokens: Annotated[str, Parameter(show=False, allow_leading_hyphen=True)],
    brief: Annotated[bool, _EVERYWHERE] = False,
    quiet: Annotated[bool, _EVERYWHERE] = False,
    log: Annotated[Path | None, _EVERYWHERE] = None,
) -> Any:
    """Run the command that the tokens name.

    Args:
        brief: print about five lines: what was computed, its first numbers and the verdict.
        quiet: show no progress and no messages; errors alone.
        log: add progress, messages and errors to this file, each with its time.
    """
    with displayed(brief=brief, quiet=quiet, log=log):
        LOG.info("ringbalance %s %s", ringbalance.__version__, shlex.join(tokens))
        return app(tokens, exit_on_error=False, print_error=False)


def _say(text: str) -> None:
    # Where messages cannot be written the exit code is all that is left.
    with suppress(OSError):
        print(text, file=sys.stderr, flush=True)


def _usage_fault(error: CycloptsError) -> str:
    if isinstance(error, MissingArgumentError) and error.argument is not None and error.argument.required:
        required = [
            parameter.name.upper()
            for parameter in signature(error.target or _build_app).parameters.values()
            if parameter.default is parameter.empty and parameter.kind is parameter.POSITIONAL_OR_KEYWORD
        ]
        missing = error.argument.field_info.names[0].upper()
        command = " ".join(("ringbalance", *(error.command_chain or ())))
        examples = " ".join(EXAMPLE_SCENES[: len(required)])
        return f"{missing} is missing: {command} {' '.join(required)}, for example {command} {examples}."
    if not isinstance(error, UnknownCommandError) or not error.unused_tokens:
        return str(error)
    # cyclopts would import every command's module to say this.
    word = error.unused_tokens[0]
    near = difflib.get_close_matches(word, COMMANDS, n=1)
    guess = f', did you mean "{near[0]}"?' if near else "."
    return f'unknown command "{word}"{guess} Commands: {", ".join(COMMANDS)}.'


def _run_guarded(arguments: Sequence[str] | None) -> int:
    try:
        result = _build_app().meta(arguments, exit_on_error=False, print_error=False)
        sys.stdout.flush()
        return result if isinstance(result, int) else DONE
    except (BrokenPipeError, KeyboardInterrupt):
        raise
    except SystemExit as stop:
        # A rich console, such as that of `--help`, exits when its reader is gone.
        if isinstance(stop.__context__, BrokenPipeError):
            raise stop.__context__ from None
        raise
    except CycloptsError as error:
        _say(f"ringbalance: {_usage_fault(error)}")
    # Looked up only when something was raised: `--help` loads no module of scenes.
    except ringbalance.SceneError as error:
        _say(str(error))
    except OSError as error:
        if error.filename:
            text = f"{error.filename}: {error.strerror}"
        elif error.errno is None:
            text = str(error)
        else:
            # An error of the system without a file name: no further process, or a full disk.
            frame = traceback.extract_tb(error.__traceback__)[-1]
            text = f"{error.strerror} (in {frame.name}, {frame.filename}, line {frame.lineno})"
        _say(f"ringbalance: {text}")
    return BAD_INPUT


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one command line.

    Args:
        arguments: the words after the program's name; default those of the process.

    Returns:
        Exit code: 0 done; 1 a check of the program failed, or what the scene requires is not met; 2 bad
        input, or output that cannot be written; 130 interrupted; 141 the reader of standard output went away.
    """
    # Before numpy is imported, and whatever the user set: one thread gives the same sums on every machine.
    os.environ.update(dict.fromkeys(THREAD_COUNTS, "1"))
    drop_unusable_size(os.environ)
    # At its end an interpreter collects garbage among all objects, whose memory the process frees anyway.
    atexit.register(gc.freeze)
    if refusal := prepare_streams() or interpreter_error():
        _say(f"ringbalance: {refusal}")
        return BAD_INPUT
    try:
        # Loading and compiling modules makes many objects and little garbage: its collection took a tenth.
        with interrupts(), seldom_collected():
            return _run_guarded(arguments)
    except KeyboardInterrupt:
        _say("ringbalance: interrupted; nothing was left half-written")
        return INTERRUPTED
    except BrokenPipeError:
        return BROKEN_PIPE
    finally:
        discard_unwritten()
