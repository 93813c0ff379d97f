"""The commands and their options, each declared once: for the shell, its `--help`, and the checks of values.

Nothing is imported here that takes time, so that `--help` loads nothing from numpy down.
"""

from __future__ import annotations

from collections.abc import Mapping
from inspect import Parameter, cleandoc
from pathlib import Path
from typing import Any, Final, Literal, NamedTuple

EXAMPLE_SCENES: Final = ("my_disc.toml", "other_disc.toml")
REQUIRED: Final = Parameter.empty


class Limits(NamedTuple):
    """Whole numbers that an option takes, and the sentence about others."""

    least: int
    problem: str
    allowed: str
    most: int = 2**63 - 1


class ShellOption(NamedTuple):
    """An option or an argument of a command."""

    hint: Any
    default: Any = None
    text: str = ""
    """Its line in `--help`; empty: it stands in the command's text."""
    kind: Any = Parameter.KEYWORD_ONLY
    limits: Limits | None = None
    ending: str | None = None
    """Ending of the name of a file that the command writes; empty: any; None: no such file."""
    parsing: Mapping[str, Any] = {}
    """Further arguments of `cyclopts.Parameter`."""


class ShellCommand(NamedTuple):
    """A command as its `--help` shows it."""

    text: str
    """Summary, and a line in `--help` for each of its own options."""
    options: Mapping[str, ShellOption]
    """By name."""
    example: str = ""
    """Arguments; SCENE stands for a scene file."""
    failure: str = ""
    """Condition of exit code 1; empty: never given."""
    begin: str = ""
    """First text of the progress, where a function of the Python interface does the work; empty: the command
    has a function of its own, which takes the options and returns the exit code."""
    headline: bool = True
    """True if the first finding stands above the numbers, see `Rows.view`."""

    @property
    def summary(self) -> str:
        """First sentence of its help."""
        return " ".join(cleandoc(self.text).partition("\n\n")[0].split())

    def epilogue(self, name: str) -> str:
        """An example, the exit codes, and the page with the rest."""
        example = " ".join(("ringbalance", name, self.example.replace("SCENE", EXAMPLE_SCENES[0]))).strip()
        failed = f"1 {self.failure}; " if self.failure else ""
        return (
            f"Example: {example}\n\n"
            f"Exit codes: 0 done; {failed}2 bad input, or output that cannot be written; 130 interrupted; "
            "141 the reader of standard output went away.\n\n"
            'All files and JSON keys: page "Commands, exit codes and JSON" of the documentation'
        )


_AT_LEAST_0: Final = Limits(0, "it is negative", "0 or more")
_AT_LEAST_1: Final = Limits(1, "there is no process to work", "a whole number of at least 1")
_GRID: Final = Limits(2, "no grid has so many points on an axis", "2 to 1001", 1001)
_SEEDS: Final = Limits(0, "out of range", "a whole number from 0 to 2^63 - 1")
_FLAG: Final = ShellOption(bool, False)
_PATH: Final = ShellOption(Path | None)
_TEXT: Final = ShellOption(str | None)
_ARGUMENT: Final = ShellOption(Path, REQUIRED, kind=Parameter.POSITIONAL_OR_KEYWORD)
_EFFORT: Final = Literal["light", "heavy"]
_OPTIONS: Final = {
    "scene": _ARGUMENT._replace(
        text="the scene file, or a bundled scene's name; an unknown name lists them."
    ),
    **dict.fromkeys(("first", "second"), _ARGUMENT),
    "case_ids": ShellOption(str, (), kind=Parameter.VAR_POSITIONAL),
    "json": _FLAG._replace(text="print one JSON document instead of tables."),
    "out": ShellOption(Path, Path("out")),
    "save": ShellOption(Path | None, ending=""),
    "csv": ShellOption(Path | None, ending=".csv"),
    "plot": ShellOption(Path | None, ending=".svg"),
    "valves": _PATH._replace(
        text="a CSV file of valves at hand (columns name, valve_lag and a flow as in [gas]), in place of "
        "those otherwise tried."
    ),
    "level": ShellOption(_EFFORT, "light"),
    "workers": ShellOption(
        int | None, None, "processes; default one for each processor.", limits=_AT_LEAST_1
    ),
    "tolerance": _TEXT._replace(
        text='in place of the scene\'s, such as "0.5 %" or 0.005; 0: the finest of all that is expensive.',
        # A negative number with a unit is refused by its reader, not taken for an option.
        parsing={"allow_leading_hyphen": True},
    ),
    "law": ShellOption(
        str,
        "calibrated",
        'of a liquid ring: "calibrated", "paper", or a file written by `ringbalance calibrate --save`.',
    ),
    "rotor": ShellOption(Literal["first", "second"] | None),
    "seed": ShellOption(int | None, None, "in place of the scene's seed.", limits=_SEEDS),
    "remedies": ShellOption(bool | None, parsing={"negative": "--no-remedies"}),
    "to": ShellOption(
        Literal["c", "st", "csv", "python", "js", "fmi2", "fmi3", "simulink", "openmodelica", "twincat"],
        REQUIRED,
    ),
    "block": ShellOption(Literal["law", "disc", "controller", "plant"] | None),
    "name": ShellOption(str, ""),
    "points": ShellOption(int | None, limits=_GRID),
    "vary": ShellOption(list[str] | None, parsing={"consume_multiple": 1}),
    "sample": ShellOption(str, ""),
    "runs": ShellOption(int, 0, limits=_AT_LEAST_0),
    "check": ShellOption(int, 3, limits=_AT_LEAST_0),
    "write": ShellOption(list[int] | None, parsing={"consume_multiple": 1}),
    "loss": ShellOption(Literal["linear", "soft_l1"], "linear"),
    **dict.fromkeys(("parameters", "next", "template"), _TEXT),
    **dict.fromkeys(("plan", "cases"), _PATH),
    "data": ShellOption(list[Path] | None),
    **dict.fromkeys(
        (
            "pressure",
            "preview",
            "in_place",
            "all_systems",
            "no_intervals",
            "no_figures",
            "list_",
            "mutations",
        ),
        _FLAG,
    ),
}
"""By name; one name means the same in every command, up to a default."""


def _options(names: str, **others: ShellOption) -> dict[str, ShellOption]:
    """Options by their names, in the order of `--help`."""
    return {name: others.get(name, _OPTIONS[name]) for name in names.split()}


COMMANDS: Final[dict[str, ShellCommand]] = {
    "report": ShellCommand(
        """Verify, calibrate, simulate and draw: everything, into a report and its annex.

        Args:
            out: folder for report.html, annex.html, evidence.json, figures/, fields/ and tables/.
            level: "heavy" also runs the cases that take long.
        """,
        _options("scene out level valves seed tolerance"),
        "SCENE --out out",
        "a check of the program failed (what becomes of the scene's requirements does not count)",
    ),
    "calibrate": ShellCommand(
        """lambda, k and the flow law of a disc, with uncertainties.

        Args:
            save: also write the flow law to this file, for `simulate --law`.
        """,
        _options("scene json save tolerance"),
        "SCENE --save law.json",
        begin="pressure and moment over the fill range, losses of the tube ...",
        headline=False,
    ),
    "simulate": ShellCommand(
        """One closed-loop balancing run.

        Args:
            csv: also write every instant of the run to this file, a column for each quantity with its unit.
            plot: also draw the run's figures on one sheet, an SVG file.
        """,
        _options("scene law json csv plot seed tolerance"),
        "SCENE --plot run.svg",
        "the run did not settle, or misses a requirement of the scene",
    ),
    "tune": ShellCommand(
        """Settings of the controller chosen by runs of drawn devices, and the fraction that they serve.

        Args:
            pressure: search the gas pressure of a liquid ring even where the scene's meets the requirement.
            remedies: try changes of the scene where the requirement is not met, and judge commercial valves
                where the scene describes none (default); --no-remedies: settings only, with an ideal valve.
            save: write the scene with the recommended settings.
        """,
        _options("scene law json pressure remedies valves save seed tolerance"),
        "SCENE --save tuned.toml",
        "the best settings miss a requirement of the scene, or it is undecided",
        begin="runs ...",
    ),
    "export": ShellCommand(
        """Law, disc, controller or plant for another program: C, FMI, structured text, Python, a table.

        Args:
            to: c (C99), fmi2 or fmi3 (a unit for co-simulation, FMI 2.0 or 3.0), st (IEC 61131-3 structured
                text), python or js (a module without dependencies), or csv (a grid of the law, or the
                matrices of the masses' loop); simulink and openmodelica take fmi2, twincat takes st.
            block: of a liquid ring law (velocity and regime of a query), disc (fills, gas and moment of all
                chambers in time, and the rotor's vibration), or controller (the scene's algorithm with its
                settings), default law; of eccentric masses controller, the default, or plant (rotor, masses
                and drives in time).
            out: folder for the files.
            name: name of files and functions; default that of the scene.
            points: points on each axis of the grid of csv, 2 to 1001; default 41.
            all_systems: units with libraries for Linux, macOS and Windows; needs the extra export-all.
        """,
        _options("scene to block out name points all_systems"),
        "SCENE --to c --out law",
    ),
    "panel": ShellCommand(
        """A page on which one watches the rotor being balanced, in one file for any browser.

        Args:
            out: file of the page; it needs no network and no other file.
            vary: axes of at most nine designs that a slider moves through, such as tube.bore=1mm:2mm:5.
        """,
        _options("scene out vary", out=ShellOption(Path, REQUIRED, ending=".html")),
        "SCENE --out panel.html",
    ),
    "sweep": ShellCommand(
        """Many designs: a row of answers for every point of a grid or a sample.

        Args:
            out: folder for table.csv, sweep.json, figures, and the store from which a sweep resumes.
            vary: axes, such as tube.bore=0.5mm:2mm:30, gas.pressure=0.4MPa,0.7MPa or gas=valves.csv.
            plan: a TOML file with vary and sample instead.
            sample: sobol:N or latin:N points of the axes' ranges instead of every combination.
            runs: largest number of simulated devices for each point, fewer where they decide; 0: static
                answers alone.
            no_intervals: no uncertainties of static answers, which take most of their time.
            check: number of rows to calibrate in full, which measures the error of the fast answers.
            no_figures: draw no figures.
            write: numbers of rows whose scenes to write.
            tolerance: in place of the scene's, such as "0.5 %" or 0.005; rows with a larger error are named.
        """,
        _options(
            "scene out vary plan sample runs no_intervals check workers no_figures write seed tolerance json",
            out=ShellOption(Path, REQUIRED),
        ),
        "SCENE --vary tube.bore=0.5mm:2mm:30 --out sweep",
    ),
    "design": ShellCommand(
        """The smallest disc, with bore, pressure, valve and settings, that meets the requirement of a scene.

        Args:
            scene: the scene file, with [requirement] and [design]; of eccentric masses the lightest,
                with guide radius, gear and motor.
            in_place: keep the disc's size, and choose bore, pressure, siphon crest, gas hole and valve;
                [design] may be left out, and a later report shows the answer.
            save: write the scene of the design, with its settings.
            plot: also draw the designs that were judged, an SVG file: fraction of devices and gas pressure
                over the volume, with what meets the requirement filled and the chosen one in a ring.
        """,
        _options("scene in_place save plot valves seed workers json"),
        "SCENE --save designed.toml",
        "no design meets the requirement of the scene, or it is undecided",
        begin="designs ...",
    ),
    "fit": ShellCommand(
        """Parameters of a built disc from measurements, with intervals and what the data identify.

        Args:
            scene: the scene file of the disc as it was designed.
            data: files of measurements, one kind in each; --template writes an empty one.
            parameters: names separated by commas, such as "bore,extra_loss"; default those that the kinds of
                data inform most.
            loss: "soft_l1" gives outliers less weight, and names their rows.
            next: the parameter that the proposed next measurement is for; default the least certain one.
            save: also write the fitted scene to this file, for all other commands.
            plot: also draw the data against the fit on one sheet, an SVG file.
            preview: only print what was understood of the files; nothing is fitted.
            template: only print an empty file of measurements of this kind, with explanations.
        """,
        _options(
            "scene data parameters loss next save plot json preview template",
            scene=ShellOption(Path | None, kind=Parameter.POSITIONAL_OR_KEYWORD),
            data=ShellOption(Path, (), kind=Parameter.VAR_POSITIONAL),
            save=_PATH,
        ),
        "SCENE rig.csv --save fitted.toml",
        "the fit does not describe its data",
    ),
    "verify": ShellCommand(
        """Run the verification cases and judge the claims of the papers.

        Args:
            case_ids: ids of cases; default all.
            cases: a folder with cases of your own (page "A verification case of your own"), which join the
                program's.
            scene: scene file; default the liquid-ring paper's disc.
            list_: only list the cases.
            mutations: also run each case with its deliberate errors, which must change its verdict.
            level: "heavy" runs the cases that take long too.
            workers: processes to spread the cases over.
            data: a file of measurements (page "Files of measurements"), judged instead of the cases; any
                number.
            json: print one JSON document instead of a table.
        """,
        _options(
            "case_ids cases scene list_ mutations level json workers data",
            scene=_PATH,
            workers=ShellOption(int, 1, limits=_AT_LEAST_1),
        ),
        "gci_celik2008 --mutations",
        "a code verification failed, or a deliberate error was not noticed",
    ),
    "compare": ShellCommand(
        """Two balancers on one rotor, side by side.

        Args:
            first: a scene file.
            second: another scene file; the order does not matter.
            rotor: "first" or "second", the scene whose rotor, vibration sensor and limit hold for both;
                needed where the two scenes describe different rotors.
            tolerance: in place of that of both scenes, such as "0.5 %" or 0.005; 0: the finest of all
                that is expensive.
            json: print one JSON document instead of a table.
        """,
        _options("first second law rotor json seed tolerance"),
        "SCENE other_disc.toml",
        "one of the two does not settle the required fraction of devices, or it is undecided",
        begin="both balancers on one rotor ...",
        headline=False,
    ),
    "trade": ShellCommand(
        """Speed against accuracy: designs per second and error of every model.

        Args:
            out: also write the document to trade.json in this folder.
            level: "light" leaves out the meshes in three dimensions.
        """,
        _options("scene json out level tolerance", out=_PATH, level=ShellOption(_EFFORT, "heavy")),
        "SCENE --level light",
        begin="models ...",
        headline=False,
    ),
    "extremes": ShellCommand(
        """Limits of validity: where results stop, what is reported beyond, and whether the invariants hold
        inside.

        Args:
            out: also write extremes.json to this folder; an interrupted run with the same folder resumes
                where it stopped.
            level: "heavy" judges thousands of points, for an hour or more.
            workers: processes; default one for each core, at most two.
        """,
        _options("scene json out level workers", out=_PATH),
        "SCENE --out extremes",
        "an invariant does not hold",
    ),
    "plot": ShellCommand(
        """The 3-D pictures of a report alone, and its pressure fields for ParaView.

        Args:
            out: folder for figures/*.png and fields/*.vtu.
        """,
        _options("scene out"),
        "SCENE --out pictures",
        "this machine cannot draw; the fields are written",
    ),
    "check-balancer": ShellCommand(
        """Check that a balancer, such as one of another package, is what every command expects.

        Args:
            name: the word of the scene's key balancer.
            scene: one of its scenes, with short runs; default the example that its package brings.
        """,
        _options(
            "name scene json",
            name=ShellOption(str, REQUIRED, kind=Parameter.POSITIONAL_OR_KEYWORD),
            scene=_PATH,
        ),
        "ball --json",
        "a check fails",
        begin="checks ...",
    ),
    "doctor": ShellCommand(
        """Check this machine: versions, packages, drawing, compiler and processes, with advice.

        Args:
            json: print one JSON document instead of a table.
        """,
        _options("json"),
        failure="something is broken",
    ),
}
"""By name."""
