"""The command line: which function answers to which command, and what the exit codes mean.

A command's module is imported only when the command runs, so that `--help` loads nothing from numpy down.
Results go to standard output, everything else to standard error.
"""

from __future__ import annotations

import difflib
import os
import sys
import traceback
from collections.abc import Sequence

from cyclopts import App, CycloptsError, Parameter, UnknownCommandError

import ringbalance

DONE = 0
BAD_INPUT = 2
INTERRUPTED = 130
BROKEN_PIPE = 141

COMMANDS = {
    "report": (
        "ringbalance.reports.cli:report",
        "Verify, calibrate, simulate and draw: everything, into one HTML file.",
    ),
    "calibrate": (
        "ringbalance.reduced_model.cli:calibrate",
        "lambda, k and the flow law of a disc, with uncertainties.",
    ),
    "simulate": ("ringbalance.controller.cli:simulate", "One closed-loop balancing run."),
    "verify": (
        "ringbalance.verification.cli:verify",
        "The verification cases and the paper's claims, judged.",
    ),
    "compare": ("ringbalance.controller.compare_cli:compare", "Two balancers on one rotor, side by side."),
    "trade": (
        "ringbalance.verification.trade_cli:trade",
        "Speed against accuracy: ladders of models measured, and the rungs that a tolerance needs.",
    ),
    "extremes": (
        "ringbalance.reports.extremes_cli:extremes",
        "Where answers end, what is said beyond, and whether all holds in between.",
    ),
    "plot": ("ringbalance.reports.cli:plot", "The off-screen 3-D pictures alone."),
}
THREAD_COUNTS = ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS")


def build_app() -> App:
    """The application with its commands, none of them imported yet."""
    app = App(
        name="ringbalance",
        help="Are the closed formulas of a liquid-ring rotor balancer to be trusted, for your disc?",
        help_epilogue=(
            "Exit codes: 0 done; 1 a code-verification case failed or a run did not settle (the result is "
            "still written); 2 bad input; 130 interrupted."
        ),
        version=ringbalance.__version__,
        default_parameter=Parameter(negative=()),
        result_action="return_value",
        suppress_keyboard_interrupt=False,
    )
    for name, (target, summary) in COMMANDS.items():
        app.command(target, name=name, help=summary)
    return app


def _say(text: str) -> None:
    print(text, file=sys.stderr)


def _usage_fault(error: CycloptsError) -> str:
    if not isinstance(error, UnknownCommandError) or not error.unused_tokens:
        return str(error)
    # cyclopts would import every command's module to say this.
    word = error.unused_tokens[0]
    near = difflib.get_close_matches(word, COMMANDS, n=1)
    guess = f', did you mean "{near[0]}"?' if near else "."
    return f'unknown command "{word}"{guess} Commands: {", ".join(COMMANDS)}.'


def _refusal(error: OSError) -> str:
    if error.filename:
        return f"{error.filename}: {error.strerror}"
    if error.errno is None:
        return str(error)
    # The machine refused something that no file name stands for, such as a process or a full disk.
    frame = traceback.extract_tb(error.__traceback__)[-1]
    return f"{error.strerror} (in {frame.name}, {frame.filename}, line {frame.lineno})"


def _run(arguments: Sequence[str] | None) -> int:
    result = build_app()(arguments, exit_on_error=False, print_error=False)
    sys.stdout.flush()
    return result if isinstance(result, int) else DONE


def _run_guarded(arguments: Sequence[str] | None) -> int:
    try:
        return _run(arguments)
    except (SystemExit, BrokenPipeError):
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
        Exit code: 0 done; 1 a code-verification case failed or a run did not settle; 2 bad input; 130
        interrupted; 141 the reader of standard output went away.
    """
    # Before numpy is imported: one thread gives the same sums on every machine.
    for name in THREAD_COUNTS:
        os.environ.setdefault(name, "1")
    try:
        return _run_guarded(arguments)
    except KeyboardInterrupt:
        _say("ringbalance: interrupted; nothing was left half-written")
        return INTERRUPTED
    except BrokenPipeError:
        # The interpreter flushes once more on its way out, and would complain.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return BROKEN_PIPE
