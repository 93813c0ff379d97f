"""What a scene keeps of its file, whatever its balancer: names, hashes, and where each value comes from."""

from dataclasses import dataclass, field
from typing import Annotated, Literal

from ringbalance.scene.keys.declaration import shown
from ringbalance.scene.loop_models import RunSettings
from ringbalance.scene.measured import Measured

Origin = Literal["given", "inferred", "assumed", "measured"]
"""In the documents of the machine; concluded from other values; chosen, as nothing is known; measured."""
ShownOrigin = Origin | Literal["derived", "default"]
"""Also: read off the mesh that the scene names; not in the file."""
KEY_OF_FIELD = {
    "rotor.initial_amplitude": "rotor.initial_vibration",
    "rotor.initial_phase": "rotor.initial_vibration",
    "tolerance": "accuracy.tolerance",
    "disc.geometry": "disc.mesh",
}
"""Path of the key from which a field of another name is read."""


@dataclass(frozen=True, kw_only=True)
class SceneFile:
    """What scenes of both kinds of balancer have."""

    name: str
    run: RunSettings
    tolerance: Annotated[float, shown("tolerance", "%", dimension="share")]
    """Relative: bounds discretisation and left-out terms."""
    source: str
    """File name without its folder; for the evidence, which is the same wherever the file stands."""
    file: str = field(compare=False)
    """The file as it was named; for messages."""
    sha256: str
    """Of the scene file's bytes."""
    values_sha256: str = ""
    """Of the values that decide results, defaults included; not of remarks, names and origins."""
    defaulted: tuple[str, ...] = ()
    """Paths such as "rotor.lag_angle" whose value is a default, because the file does not give it."""
    measured: Measured = field(default_factory=Measured)
    origins: tuple[tuple[str, ShownOrigin], ...] = ()
    """Origin of each key by path; empty for a scene that was not read from a file."""

    def origin_of(self, path: str) -> ShownOrigin:
        """Where the value at a path such as "tube.bore" comes from.

        Returns: What the table's `origin` states, "given" where it states nothing, "derived" for a dimension
            of a mesh, and "default" for a value that the file does not give.
        Raises: ValueError: a scene file has no such key.
        """
        if not self.origins:
            return "given"
        found = dict(self.origins).get(KEY_OF_FIELD.get(path, path))
        if found is None:
            raise ValueError(f"a scene file has no key {path!r}")
        return found
