"""The work of the command `ringbalance fit`, which draws too: `reports.fit_cli`."""

from __future__ import annotations

import json as json_format
from collections.abc import Sequence
from pathlib import Path

from ringbalance.identification.criticism import Review
from ringbalance.identification.documents import fit_document, fit_rows
from ringbalance.identification.fitting import FitResult, Loss, problem_of
from ringbalance.identification.fitting import fit as fit_scene
from ringbalance.identification.next_measurement import next_measurement
from ringbalance.identification.parameters import FitError
from ringbalance.identification.reading import read_observations
from ringbalance.identification.saving import save_result
from ringbalance.results.result import print_rows
from ringbalance.scene.faults import SceneError, did_you_mean
from ringbalance.scene.loader import load_scene
from ringbalance.scene.platform.files import check_file
from ringbalance.scene.platform.terminal import activity, print_message

DONE, FAILED = 0, 1
_USAGE = (
    "ringbalance fit SCENE DATA.csv [DATA.csv ...], for example ringbalance fit my_disc.toml injections.csv; "
    "ringbalance fit --template KIND prints an empty file of measurements"
)


def run_fit(
    scene: Path | None,
    data: Sequence[Path],
    *,
    parameters: str | None,
    loss: Loss,
    next: str | None,
    save: Path | None,
    json: bool,
) -> tuple[int, FitResult]:
    """Fit, print and save, as `reports.fit_cli.fit` describes.

    Returns: Exit code and result. Raises: SceneError, OSError.
    """
    if scene is None or not data:
        raise _usage("command line", f"{'SCENE' if scene is None else 'DATA'} is missing")
    if save is not None:
        keep_inputs(save, (scene, *data))
        check_file(save)
    if scene.suffix.lower() == ".csv":
        raise _usage(str(scene), "this looks like a file of measurements, and the scene comes first")
    stated_scene = load_scene(scene)
    observations = read_observations(data, scene=stated_scene)
    names = None if parameters is None else [name.strip() for name in parameters.split(",")]
    if names is not None and (not all(names) or len(set(names)) < len(names)):
        problem = "it is not a list of different names with commas between"
        allowed = 'such as "bore,extra_loss"'
        raise SceneError.of_option(
            option="--parameters", value=parameters or "", problem=problem, allowed=allowed
        )
    try:
        fitted = [each.name for each in problem_of(stated_scene, observations, names).parameters]
        if next is not None and next not in fitted:
            problem = f"this parameter is not fitted{did_you_mean(next, fitted)}"
            listed = ", ".join(fitted)
            raise SceneError.of_option(option="--next", value=next, problem=problem, allowed=listed)
        with activity("fit", "several starts, profiles of the likelihood ..."):
            result = fit_scene(stated_scene, data=observations, parameters=names, loss=loss)
    except FitError as error:
        raise SceneError.of_file(stated_scene.file, str(error)) from error
    review, following = Review.of(result), next_measurement(result, next)
    if json:
        document = fit_document(result, data=observations, review=review, next_measurement=following)
        print(json_format.dumps(document, allow_nan=False))
    else:
        rows = fit_rows(result, data=observations, review=review, next_measurement=following)
        print_rows(rows, headline=False)
    if save is not None:
        save_result(save, scene=stated_scene, result=result, data=observations, said=review.text)
        print_message(f"fitted scene written to {save}")
    return (DONE if review.describes else FAILED), result


def keep_inputs(save: Path, inputs: Sequence[Path]) -> None:
    """Raises: SceneError: a file that is written would take the place of one that is read."""
    for each in inputs:
        if save.exists() and each.exists() and save.samefile(each):
            problem = "the fitted scene would replace a file that is read here"
            raise SceneError.of_option(
                option="--save", value=str(save), problem=problem, allowed="another file"
            )


def _usage(file: str, problem: str) -> SceneError:
    return SceneError.of_file(file, f"{problem}: {_USAGE}")
