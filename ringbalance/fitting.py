"""Fits of a built disc to measurements, for Python and as a command."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import product
from os import PathLike
from pathlib import Path
from types import SimpleNamespace
from typing import Final

from ringbalance.identification.criticism import Review
from ringbalance.identification.documents import Fit
from ringbalance.identification.fitting import Loss, problem_of
from ringbalance.identification.fitting import fit as fit_scene
from ringbalance.identification.kinds.kind import Observations
from ringbalance.identification.next_measurement import next_measurement
from ringbalance.identification.parameters import FitError
from ringbalance.identification.reading import preview, read_observations
from ringbalance.identification.reading import template as template_of
from ringbalance.identification.saving import kept_start, save_result
from ringbalance.interface import checked, print_result
from ringbalance.scene import AnyScene, SceneError, load_scene
from ringbalance.scene.faults import did_you_mean
from ringbalance.scene.platform.files import check_file
from ringbalance.scene.platform.terminal import activity, print_message

_USAGE: Final = (
    "ringbalance fit SCENE DATA.csv [DATA.csv ...], for example ringbalance fit my_disc.toml injections.csv; "
    "ringbalance fit --template KIND prints an empty file of measurements"
)


@checked
def fit(
    scene: AnyScene,
    data: str | PathLike[str] | Sequence[str | PathLike[str]],
    *,
    parameters: Sequence[str] | None = None,
    loss: Loss = "linear",
    next: str | None = None,
) -> Fit:
    """Fit parameters of a built disc to files of measurements, with intervals and what the data identify.

    Args: `data`: one file or several, one kind of measurement in each. `parameters`: names; default those
        that the kinds of data inform. `loss`: "soft_l1" counts outliers less. `next`: the parameter for which
        to find the next measurement; default the one that the data identify least.
    Raises: SceneError: a scene, a file or a parameter that cannot be used.

    Example:
        >>> scene = rb.load_scene(rb.bundled_scene("liquid_ring_paper"))
        >>> data = rb.bundled_scene("liquid_ring_paper").parent / "measurements" / "trial_weight.csv"
        >>> [parameter.name for parameter in rb.fit(scene, data).parameters]
        ['influence_coefficient', 'lag_angle']
    """
    files = [data] if isinstance(data, str | PathLike) else data
    observations = read_observations([Path(each) for each in files], scene=scene)
    return _fit(scene, observations, parameters, loss, next)


def _fit(
    scene: AnyScene,
    observations: tuple[Observations, ...],
    parameters: Sequence[str] | None,
    loss: Loss,
    next: str | None,
    option: str = "next",
) -> Fit:
    """Fit, test the fit, find the next measurement. Args: `option`: name of `next` in a message."""
    try:
        names = [each.name for each in problem_of(scene, observations, parameters).parameters]
        if next is not None and next not in names:
            problem, allowed = f"this parameter is not fitted{did_you_mean(next, names)}", ", ".join(names)
            raise SceneError.of_option(option=option, value=next, problem=problem, allowed=allowed)
        result = fit_scene(scene, data=observations, parameters=parameters, loss=loss)
    except FitError as error:
        raise SceneError.of_file(scene.file, str(error)) from error
    return Fit(
        result=result,
        data=observations,
        review=Review.of(result),
        next_measurement=next_measurement(result, next),
    )


def fit_files(options: SimpleNamespace) -> int:
    """Run the command `fit`. Returns: Exit code: 1 when the fit does not describe its data."""
    if options.template is not None:
        print(template_of(options.template), end="")
        return 0
    if options.scene is None or not options.data:
        raise SceneError.of_file(
            "command line", f"{'DATA' if options.scene else 'SCENE'} is missing: {_USAGE}"
        )
    for written, read in product((options.plot, options.save), (options.scene, *options.data)):
        if written and written.exists() and read.exists() and written.samefile(read):
            problem = "the fitted scene would replace a file that is read here"
            raise SceneError.of_option(
                option="--save", value=str(written), problem=problem, allowed="another file"
            )
    if options.save is not None:
        check_file(options.save)
    if options.scene.suffix.lower() == ".csv":
        problem = "this looks like a file of measurements, and the scene comes first"
        raise SceneError.of_file(str(options.scene), f"{problem}: {_USAGE}")
    scene, names = load_scene(options.scene), None
    if options.parameters is not None:
        names = [name.strip() for name in options.parameters.split(",")]
        if not all(names) or len(set(names)) < len(names):
            problem = "it is not a list of different names with commas between"
            allowed = 'such as "bore,extra_loss"'
            raise SceneError.of_option(
                option="--parameters", value=options.parameters, problem=problem, allowed=allowed
            )
    understood = read_observations(options.data, scene=scene)
    if options.preview:
        print("\n".join(preview(each) for each in understood))
        return 0
    for each in understood:
        for remark in each.remarks:
            print_message(f"{each.file}: {remark}")
    with activity("fit", "several starts, profiles of the likelihood ..."):
        result = _fit(scene, understood, names, options.loss, options.next, option="--next")
    print_result(result, json=options.json, headline=False)
    if options.save is not None:
        text = result.review.text
        save_result(options.save, scene=scene, result=result.result, data=result.data, said=text)
        print_message(f"fitted scene written to {options.save}")
        for sentence in kept_start(scene, result.data):
            print_message(sentence)
    if options.plot is not None:
        result.plot(options.plot)
    return 0 if result.succeeded else 1
