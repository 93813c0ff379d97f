"""The commands `ringbalance tune` and `ringbalance compare`."""

from __future__ import annotations

import json as json_format
from pathlib import Path
from typing import Annotated, Literal

from cyclopts import Parameter

from ringbalance.controller.balancer import balancer_of, balancer_under, takes
from ringbalance.controller.compare import compare as compare_balancers
from ringbalance.controller.judging.tune import tuned
from ringbalance.results.requirements import MET
from ringbalance.results.result import print_rows
from ringbalance.scene.changes import file_text
from ringbalance.scene.loader import load_scene
from ringbalance.scene.narrowing import Models, with_tolerance
from ringbalance.scene.platform.files import check_file, write_whole
from ringbalance.scene.platform.terminal import activity


def tune(
    scene: Path,
    *,
    law: str = "calibrated",
    json: bool = False,
    pressure: bool = False,
    remedies: Annotated[bool | None, Parameter(negative="--no-remedies")] = None,
    save: Path | None = None,
    tolerance: str | None = None,
    models: Models | None = None,
) -> int:
    """Recommend settings of a balancer's controller, by runs of what the scene's device may be.

    Args:
        scene: the scene file.
        law: of a liquid ring: "calibrated", "paper", or a file written by `ringbalance calibrate --save`.
        json: print one JSON document instead of tables.
        pressure: search the gas pressure of a liquid ring even where the scene's meets what is required.
        remedies: try valves that can be bought, too, for a scene that gives none. Default: where what is
            required is not met, changes of the scene; --no-remedies tries nothing but settings.
        save: write the scene with the recommended settings.
        tolerance: in place of the scene's, such as "0.5 %" or 0.005.
        models: "finest" takes the finest of all that is expensive, as at a tolerance of zero.

    Returns:
        Exit code: 0 the scene's requirements are met with what is recommended; 1 otherwise; the result is
        printed either way.

    Raises:
        SceneError: a scene or a law that cannot be used.
        OSError: a file that cannot be written.
    """
    if save is not None:
        check_file(save, apart_from=scene)
    balancer = balancer_under(law, with_tolerance(load_scene(scene), tolerance=tolerance, models=models))
    with activity("tune", "runs ...") as shown:
        found = tuned(balancer, along=pressure, remedies=remedies, progress=shown.show)
    if save is not None:
        write_whole(save, file_text(found.recommended_scene, to=save.parent))
    if json:
        print(json_format.dumps(found.to_dict(), allow_nan=False))
    else:
        print_rows(found.rows())
    return 0 if found.succeeded else 1


def compare(
    first: Path,
    second: Path,
    *,
    law: str = "calibrated",
    rotor: Literal["first", "second"] | None = None,
    json: bool = False,
    tolerance: str | None = None,
    models: Models | None = None,
) -> int:
    """Run two balancers, both tuned, on one rotor as the same drawn devices.

    Args:
        first: a scene file.
        second: another scene file; the order does not matter.
        rotor: "first" or "second", the scene whose rotor, vibration sensor and limit hold for both; needed
            where the two scenes describe different rotors.
        law: of a liquid ring: "calibrated", "paper", or a file written by `ringbalance calibrate --save`.
        json: print one JSON document instead of a table.
        tolerance: in place of that of both scenes, such as "0.5 %" or 0.005.
        models: "finest" takes the finest of all that is expensive, as at a tolerance of zero.

    Returns:
        Exit code: 0 both settle the fraction of devices that the first scene requires, 1 not both, or it is
        undecided; the result is printed either way.

    Raises:
        SceneError: a scene that cannot be used, or a balancer that cannot work on that rotor.
    """
    one, other = (
        balancer_of(scene, flow_law=law if takes(scene, "flow_law") else None)
        for path in (first, second)
        for scene in [with_tolerance(load_scene(path), tolerance=tolerance, models=models)]
    )
    with activity("compare", "both balancers on one rotor ...") as shown:
        found = compare_balancers(one, other, rotor=rotor, progress=shown.show)
    if json:
        print(json_format.dumps(found.to_dict(), allow_nan=False))
    else:
        print_rows(found.rows(), headline=False)
    return 0 if set(found.verdicts) == {MET} else 1
