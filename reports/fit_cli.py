"""The command `ringbalance fit`."""

from __future__ import annotations

import json as json_format
from collections.abc import Sequence
from pathlib import Path

from ringbalance.identification.criticism import Review
from ringbalance.identification.documents import against_fit, fit_document, fit_rows
from ringbalance.identification.fitting import FitResult, Loss, problem_of
from ringbalance.identification.fitting import fit as fit_scene
from ringbalance.identification.kinds.kind import Observations
from ringbalance.identification.next_measurement import next_measurement
from ringbalance.identification.parameters import FitError
from ringbalance.identification.reading import read_observations
from ringbalance.identification.reading import template as template_of
from ringbalance.identification.saving import save_result
from ringbalance.reports.simulate_cli import check_output
from ringbalance.results.result import print_rows
from ringbalance.scene import AnyScene
from ringbalance.scene.faults import SceneError, did_you_mean
from ringbalance.scene.loader import load_scene
from ringbalance.scene.platform.files import check_file, write_whole
from ringbalance.scene.platform.terminal import activity, print_message

_DONE, _FAILED = 0, 1
_USAGE = (
    "ringbalance fit SCENE DATA.csv [DATA.csv ...], for example ringbalance fit my_disc.toml injections.csv; "
    "ringbalance fit --template KIND prints an empty file of measurements"
)


def fit(
    scene: Path | None = None,
    *data: Path,
    parameters: str | None = None,
    loss: Loss = "linear",
    next: str | None = None,
    save: Path | None = None,
    plot: Path | None = None,
    json: bool = False,
    template: str | None = None,
) -> int:
    """Fit parameters of a built disc to measurements, with intervals and what the data identify.

    Args:
        scene: the scene file of the disc as it was designed.
        data: files of measurements (docs/fit.md), one kind in each.
        parameters: names with commas between, such as "bore,extra_loss"; default those that the kinds of data
            tell most about.
        loss: "soft_l1" counts outliers less, and says which rows they are.
        next: the parameter for which to say what to measure next; default the one that the data identify
            least.
        save: also write the fitted scene to this file, for all other commands.
        plot: also draw the data against the fit on one sheet, an SVG file.
        json: print one JSON document instead of tables.
        template: print an empty file of measurements of this kind, with explanations, and do nothing else.

    Returns:
        Exit code: 1 when the fit does not describe the data, or another law does so better.

    Raises:
        SceneError: a scene, a file of measurements or a parameter that cannot be used.
        OSError: the fitted scene or the plot cannot be written.
    """
    if template is not None:
        print(template_of(template), end="")
        return _DONE
    check_output("--plot", plot, ".svg")
    if plot is not None and scene is not None:
        _keep_inputs(plot, (scene, *data))
    if scene is None or not data:
        raise _usage("command line", f"{'SCENE' if scene is None else 'DATA'} is missing")
    if save is not None:
        _keep_inputs(save, (scene, *data))
        check_file(save)
    if scene.suffix.lower() == ".csv":
        raise _usage(str(scene), "this looks like a file of measurements, and the scene comes first")
    given = load_scene(scene)
    observations = read_observations(data, scene=given)
    result = _fitted(given, observations, parameters=parameters, loss=loss, next_name=next)
    review, following = Review.of(result), next_measurement(result, next)
    if json:
        document = fit_document(result, data=observations, told=review, following=following)
        print(json_format.dumps(document, allow_nan=False))
    else:
        rows = fit_rows(result, data=observations, told=review, following=following)
        print_rows(rows, headline=False)
    if save is not None:
        save_result(save, scene=given, result=result, data=observations, said=review.sentences)
        print_message(f"fitted scene written to {save}")
    if plot is not None:
        # Loading what draws takes as long as a short fit.
        from ringbalance.reports.figure import sheet  # noqa: PLC0415
        from ringbalance.reports.pages.measured import fit_figures  # noqa: PLC0415

        write_whole(plot, sheet(fit_figures(against_fit(result))))
    return _DONE if review.holds else _FAILED


def _fitted(
    scene: AnyScene,
    data: Sequence[Observations],
    *,
    parameters: str | None,
    loss: Loss,
    next_name: str | None,
) -> FitResult:
    """Raises: SceneError: these data or parameters cannot be fitted, or `next_name` is not among them."""
    names = None if parameters is None else _names(parameters)
    try:
        fitted = [each.name for each in problem_of(scene, data, names).parameters]
        _check_fitted(next_name, fitted)
        with activity("fit", "several starts, profiles of the likelihood ..."):
            return fit_scene(scene, data=data, parameters=names, loss=loss)
    except FitError as error:
        raise SceneError.of_file(scene.file, str(error)) from error


def _check_fitted(name: str | None, fitted: Sequence[str]) -> None:
    if name is not None and name not in fitted:
        problem = f"this parameter is not fitted{did_you_mean(name, fitted)}"
        raise SceneError.of_option(option="--next", value=name, problem=problem, allowed=", ".join(fitted))


def _keep_inputs(save: Path, inputs: Sequence[Path]) -> None:
    """Raises: SceneError: a file that is written would take the place of one that is read."""
    for each in inputs:
        if save.exists() and each.exists() and save.samefile(each):
            problem = "the fitted scene would replace a file that is read here"
            raise SceneError.of_option(
                option="--save", value=str(save), problem=problem, allowed="another file"
            )


def _usage(file: str, problem: str) -> SceneError:
    return SceneError.of_file(file, f"{problem}: {_USAGE}")


def _names(text: str) -> list[str]:
    names = [name.strip() for name in text.split(",")]
    if not all(names) or len(set(names)) < len(names):
        problem = "it is not a list of different names with commas between"
        allowed = 'such as "bore,extra_loss"'
        raise SceneError.of_option(option="--parameters", value=text, problem=problem, allowed=allowed)
    return names
