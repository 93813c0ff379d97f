"""Reader of a law's file; its errors are reported together, in the form of a scene's."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from types import MappingProxyType
from typing import Any, Final

from ringbalance.reduced_model.law import version_4
from ringbalance.reduced_model.law.calibrated_law import CalibratedLaw
from ringbalance.reduced_model.law.flow_law import FORMAT, VERSION, CompleteLaw
from ringbalance.reduced_model.law.paper_law import PaperLaw
from ringbalance.scene.faults import Fault, SceneError
from ringbalance.scene.platform.files import NOT_TEXT
from ringbalance.scene.typed_record import record_from

_LAWS: Final[Mapping[str, type[CompleteLaw]]] = MappingProxyType(
    {"CalibratedLaw": CalibratedLaw, "PaperLaw": PaperLaw}
)


def load_law(path: Path | str) -> CompleteLaw:
    """Read a law that a law's `save` wrote, also one of version 4.

    Returns: The law, equal to the saved one bit for bit; it carries its moment, volumes and density.  Of
        version 4 all but half-widths, and whether a regime is undecided, are equal.
    Raises: SceneError: a file that cannot be read or is no law; every fault names key, value and what is
        allowed.

    Example:
        >>> scene = rb.load_scene(rb.bundled_scene("liquid_ring_paper"))
        >>> law = rb.calibrate(scene).flow_law
        >>> path = law.save("law.json")
        >>> again = rb.load_law(path)
        >>> conditions = {"fill_ratio": 0.25, "gas_pressure": 0.7e6}
        >>> bool(again.evaluate(**conditions) == law.evaluate(**conditions))
        True
    """
    file = Path(path)
    wanted = f'a file written by "ringbalance calibrate SCENE --save {file.name}"'
    try:
        content = json.loads(file.read_text(encoding="utf-8"))
    except OSError as error:
        problem = f"the file cannot be read: {error.strerror or error}"
        raise SceneError.of_file(str(file), problem, wanted) from error
    except UnicodeDecodeError as error:
        raise SceneError.of_file(str(file), NOT_TEXT, wanted) from error
    except (ValueError, RecursionError) as error:
        raise SceneError.of_file(str(file), f"the file is not JSON: {error}", wanted) from error
    if not isinstance(content, dict) or content.get("format") != FORMAT:
        raise SceneError.of_file(str(file), "the file is not a saved law", wanted)
    if content.get("version") not in (VERSION, 4):
        problem = "written by another release, whose law lacks what this one needs: calibrate again"
        raise SceneError.of_file(str(file), problem, f"version {VERSION}, or 4")
    law = content.get("law")
    kind = str(law.get("type")) if isinstance(law, dict) else ""
    if kind not in _LAWS:
        fault = Fault(file=str(file), table="law", problem="this is no law", allowed=", ".join(_LAWS))
        raise SceneError([fault])
    if kind == CalibratedLaw.__name__ and content["version"] != VERSION:
        return _law_of_version_4(law, str(file))
    return record_from(_LAWS[kind], law, file=str(file), path="law")


def _law_of_version_4(data: Any, file: str) -> CalibratedLaw:
    try:
        document, held = version_4.split(data)
        both = [version_4.split(each)[0] for each in held["variants"]]
    except (KeyError, TypeError, ValueError, IndexError, AttributeError) as error:
        raise SceneError.of_file(file, "this is no whole law of version 4", "calibrate again") from error
    law, *variants = (record_from(CalibratedLaw, each, file=file, path="law") for each in (document, *both))
    return replace(law, half_widths=version_4.half_widths(law, held, variants))
