"""The command `ringbalance fit`."""

from __future__ import annotations

import json as json_format
from pathlib import Path

from ringbalance.identification.data.reading import read_observations
from ringbalance.identification.data.template import template as template_of
from ringbalance.identification.documents import fit_document
from ringbalance.identification.fitting import Loss
from ringbalance.identification.fitting import fit as fit_scene
from ringbalance.identification.parameters import FitError
from ringbalance.identification.show import fit_view
from ringbalance.scene.faults import Fault, SceneError, option_error
from ringbalance.scene.loader import load_scene
from ringbalance.scene.narrowing import liquid_ring_scene
from ringbalance.scene.platform.progress import activity
from ringbalance.scene.platform.terminal import results_console

DONE = 0
_USAGE = (
    "ringbalance fit SCENE DATA.csv [DATA.csv ...], for example ringbalance fit my_disc.toml injections.csv; "
    "ringbalance fit --template KIND prints an empty file of measurements"
)


def fit(
    scene: Path | None = None,
    *data: Path,
    parameters: str | None = None,
    loss: Loss = "linear",
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
        json: print one JSON document instead of tables.
        template: print an empty file of measurements of this kind, with explanations, and do nothing else.

    Returns:
        Exit code 0.

    Raises:
        SceneError: a scene, a file of measurements or a parameter that cannot be used.
    """
    if template is not None:
        print(template_of(template), end="")
        return DONE
    if scene is None or not data:
        raise _missing("SCENE" if scene is None else "DATA")
    given = liquid_ring_scene(load_scene(scene))
    observations = read_observations(data, scene=given)
    names = None if parameters is None else _names(parameters)
    try:
        with activity("fit", "several starts, profiles of the likelihood ..."):
            result = fit_scene(given, data=observations, parameters=names, loss=loss)
    except FitError as error:
        fault = Fault(file=given.file, table="", key="", value="", problem=str(error), allowed="")
        raise SceneError([fault]) from error
    if json:
        print(json_format.dumps(fit_document(result, data=observations), allow_nan=False))
    else:
        results_console().print(fit_view(result, data=observations))
    return DONE


def _missing(word: str) -> SceneError:
    problem = f"{word} is missing: {_USAGE}"
    return SceneError([Fault(file="command line", table="", key="", value="", problem=problem, allowed="")])


def _names(text: str) -> list[str]:
    names = [name.strip() for name in text.split(",")]
    if not all(names) or len(set(names)) < len(names):
        problem = "it is not a list of different names with commas between"
        allowed = 'such as "bore,extra_loss"'
        raise option_error(option="--parameters", value=text, problem=problem, allowed=allowed)
    return names
