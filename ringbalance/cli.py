"""The command line: which function answers to which command, and what the exit codes mean.

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
from collections.abc import Sequence
from contextlib import suppress
from functools import partial
from inspect import signature
from pathlib import Path
from typing import Annotated, Any, NamedTuple, get_args

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
from ringbalance.scene.platform.display import LOG, displayed
from ringbalance.scene.platform.memory import seldom_collected
from ringbalance.signals import interrupts
from ringbalance.streams import discard_unwritten, drop_unusable_size, interpreter_error, prepare_streams

DONE = 0
BAD_INPUT = 2
INTERRUPTED = 130
BROKEN_PIPE = 141
EXAMPLE_SCENES = ("my_disc.toml", "other_disc.toml")

_EVERYWHERE = Parameter(group=Group("Options of every command", sort_key=100), show_default=False)


class Command(NamedTuple):
    """A command as its `--help` shows it."""

    target: str
    """Module and function."""
    summary: str
    example: str
    """Arguments; SCENE stands for a scene file."""
    failure: str
    """Condition of exit code 1; empty: never given."""

    def epilogue(self, name: str) -> str:
        """An example, the exit codes, and the page with the rest."""
        example = " ".join(("ringbalance", name, self.example.replace("SCENE", EXAMPLE_SCENES[0]))).strip()
        failed = f"1 {self.failure}; " if self.failure else ""
        return (
            f"Example: {example}\n\n"
            f"Exit codes: 0 done; {failed}2 bad input, or output that cannot be written; 130 interrupted; "
            "141 the reader of standard output went away.\n\n"
            f"All options, files and JSON keys: docs/commands.md"
        )


COMMANDS = {
    "report": (
        "ringbalance.reports.cli:report",
        "Verify, calibrate, simulate and draw: everything, into a report and its annex.",
        "SCENE --out out",
        "a check of the program failed (what becomes of the scene's requirements does not count)",
    ),
    "calibrate": (
        "ringbalance.reduced_model.cli:calibrate",
        "lambda, k and the flow law of a disc, with uncertainties.",
        "SCENE --save law.json",
        "",
    ),
    "simulate": (
        "ringbalance.reports.simulate_cli:simulate",
        "One closed-loop balancing run.",
        "SCENE --plot run.svg",
        "the run did not settle, or misses what the scene requires",
    ),
    "tune": (
        "ringbalance.controller.cli:tune",
        "Settings of the controller chosen by runs of drawn devices, and the fraction that they serve.",
        "SCENE --save tuned.toml",
        "what the scene requires is not met with the best settings, or it is undecided",
    ),
    "export": (
        "ringbalance.export.cli:export",
        "The flow law for another program: C, FMI, structured text, a Python module, a table.",
        "SCENE --to c --out law",
        "",
    ),
    "sweep": (
        "ringbalance.design.cli:sweep",
        "Many designs: a row of answers for every point of a grid or a sample.",
        "SCENE --vary tube.bore=0.5mm:2mm:30 --out sweep",
        "",
    ),
    "design": (
        "ringbalance.design.design_cli:design",
        "The smallest disc, with bore, pressure, valve and settings, that meets what a scene requires.",
        "SCENE --save designed.toml",
        "no design meets what the scene requires, or it is undecided",
    ),
    "fit": (
        "ringbalance.reports.fit_cli:fit",
        "Parameters of a built disc from measurements, with intervals and what the data identify.",
        "SCENE rig.csv --save fitted.toml",
        "the fit does not describe its data",
    ),
    "verify": (
        "ringbalance.verification.cli:verify",
        "The verification cases and the paper's claims, judged.",
        "gci_celik2008 --mutations",
        "a code verification failed, or a mutation was not noticed",
    ),
    "compare": (
        "ringbalance.controller.cli:compare",
        "Two balancers on one rotor, side by side.",
        "SCENE other_disc.toml",
        "one of the two does not settle the fraction of devices that is asked for, or it is undecided",
    ),
    "trade": (
        "ringbalance.verification.trade:trade",
        "Speed against accuracy: designs a second and error of every model.",
        "SCENE --level light",
        "",
    ),
    "extremes": (
        "ringbalance.verification.extremes.study:extremes",
        "Limits of validity: where results stop, what is reported beyond, and whether the invariants hold "
        "inside.",
        "SCENE --out extremes",
        "an invariant does not hold",
    ),
    "plot": (
        "ringbalance.reports.cli:plot",
        "The off-screen 3-D pictures alone.",
        "SCENE --out pictures",
        "this machine cannot draw; the fields are written",
    ),
    "doctor": (
        "ringbalance.doctor:doctor",
        "What this machine gives the program, and what to do where something lacks.",
        "",
        "something is broken",
    ),
}
"""By name, see `Command`."""
THREAD_COUNTS = (
    "OPENBLAS_NUM_THREADS",
    "OMP_NUM_THREADS",
    "MKL_NUM_THREADS",
    "BLIS_NUM_THREADS",
    "VECLIB_MAXIMUM_THREADS",
    "NUMEXPR_NUM_THREADS",
)


def _converted(hint: Any, tokens: Sequence[Token]) -> Any:
    """As cyclopts converts an argument, but a whole number is not made of another one by rounding, nor a file
    of a folder's name."""
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
            "Begin with: ringbalance report my_disc.toml (README.md has a scene to copy, docs/ all pages)."
        ),
        version=ringbalance.__version__,
        default_parameter=Parameter(negative=(), converter=_converted),
        result_action="return_value",
        suppress_keyboard_interrupt=False,
    )
    for name, entry in COMMANDS.items():
        command = Command._make(entry)
        app.command(command.target, name=name, help=command.summary, help_epilogue=command.epilogue(name))
    app.register_install_completion_command(
        help="Let this shell (bash, zsh or fish) complete names of commands and options.", help_epilogue=""
    )
    app.meta.suppress_keyboard_interrupt = False
    app.meta.default(partial(_dispatch, app))
    return app


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
        return _missing(error)
    if not isinstance(error, UnknownCommandError) or not error.unused_tokens:
        return str(error)
    # cyclopts would import every command's module to say this.
    word = error.unused_tokens[0]
    near = difflib.get_close_matches(word, COMMANDS, n=1)
    guess = f', did you mean "{near[0]}"?' if near else "."
    return f'unknown command "{word}"{guess} Commands: {", ".join(COMMANDS)}.'


def _missing(error: MissingArgumentError) -> str:
    required = [
        parameter.name.upper()
        for parameter in signature(error.target or _build_app).parameters.values()
        if parameter.default is parameter.empty and parameter.kind is parameter.POSITIONAL_OR_KEYWORD
    ]
    missing = error.argument.field_info.names[0].upper() if error.argument else ""
    command = " ".join(("ringbalance", *(error.command_chain or ())))
    examples = " ".join(EXAMPLE_SCENES[: len(required)])
    return f"{missing} is missing: {command} {' '.join(required)}, for example {command} {examples}."


def _refusal(error: OSError) -> str:
    if error.filename:
        return f"{error.filename}: {error.strerror}"
    if error.errno is None:
        return str(error)
    # The machine refused something that no file name stands for, such as a process or a full disk.
    frame = traceback.extract_tb(error.__traceback__)[-1]
    return f"{error.strerror} (in {frame.name}, {frame.filename}, line {frame.lineno})"


def _run(arguments: Sequence[str] | None) -> int:
    result = _build_app().meta(arguments, exit_on_error=False, print_error=False)
    sys.stdout.flush()
    return result if isinstance(result, int) else DONE


def _run_guarded(arguments: Sequence[str] | None) -> int:
    try:
        return _run(arguments)
    except (BrokenPipeError, KeyboardInterrupt):
        raise
    except SystemExit as stop:
        # A rich console, such as that of `--help`, exits when nobody reads it.
        if isinstance(stop.__context__, BrokenPipeError):
            raise stop.__context__ from None
        raise
    except CycloptsError as error:
        _say(f"ringbalance: {_usage_fault(error)}")
    # Looked up only when something was raised: the room of scenes is not loaded for `--help`.
    except ringbalance.SceneError as error:
        _say(str(error))
    except OSError as error:
        _say(f"ringbalance: {_refusal(error)}")
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
    # An interpreter that ends looks for garbage in all that it holds, which its process gives back anyway.
    atexit.register(gc.freeze)
    if refusal := prepare_streams() or interpreter_error():
        _say(f"ringbalance: {refusal}")
        return BAD_INPUT
    try:
        # Modules, and what compiles them, make many objects and little garbage: looking for it took a tenth.
        with interrupts(), seldom_collected():
            return _run_guarded(arguments)
    except KeyboardInterrupt:
        _say("ringbalance: interrupted; nothing was left half-written")
        return INTERRUPTED
    except BrokenPipeError:
        return BROKEN_PIPE
    finally:
        discard_unwritten()
