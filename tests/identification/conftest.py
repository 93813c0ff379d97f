"""One sound file of each kind of data, as text."""

from __future__ import annotations

import pytest

from ringbalance.identification.reading import template

ROWS = {
    "trial_weight": ("0,0,10,90,a", "100,0,11.5,85,a", "100,180,9.2,97,a"),
    "trial_amplitude": ("0,0,10,a", "100,0,11.5,a", "100,180,9.2,a"),
    "injection": ("A,50,0.7,10,90,9.6,91,a", "C,50,0.7,9.6,91,10,90,a", "B,80,0.7,10,90,9.9,86,a"),
    "transfer": ("0.25,0.7,200,1.8,a", "0.25,0.7,400,3.6,a", "0.3,0.7,200,1.9,a"),
    "flow": ("20,4.1,a", "50,6.9,a", "100,10.2,a"),
    "pressure": ("44.5,0.25,210,a", "44.5,0.4,330,a"),
    "run_up": ("90,400,10,a", "200,900,30,a"),
    "friction": ("0.0371,5200,a", "0.0330,8100,a"),
    "tube_at_rest": ("100,1.2,1,180,998,1,a", "150,1.5,1,180,998,1,a"),
    "vessel": ("1.5,4,10,1,293,1,1,a", "2.5,3,10,1,293,1,1,a"),
    "wave_frequency": ("1.519,0.3333,a", "1.6,0.5,a"),
    "vibration": ("62.2,4,a", "50.1,3,a"),
    "positioning": ("0.1,1.5,100,3,a", "0.2,1.5,100,8,a"),
}


def filled(kind: str) -> str:
    """The template of a kind with what a test engineer would write into it."""
    empty = template(kind).replace('source = ""', 'source = "rig 4, 12 March"')
    return empty.replace('amplitude = ""', 'amplitude = "zero_to_peak"') + "\n".join(ROWS[kind]) + "\n"


@pytest.fixture(scope="session")
def sound_files() -> dict[str, str]:
    """Text by kind."""
    return {kind: filled(kind) for kind in ROWS}
