"""Motor and gear of an eccentric mass: what a voltage does, and what it costs.

The motor shaft turns n = N_3 / N_1 times as fast as the mass along the track.  Without inductance and with
i = (V - K_m n phi') / R_m the torque on the mass is

    u = n K_i V / R_m - n^2 K_i K_m / R_m phi' - J_add phi'',

positive voltage driving the mass with the rotation.  The signs follow from K_i i = J_1 theta_1'' + T_1 on the
motor shaft, T_2 = J_2 theta_2'' + T_3 on gear B, equal power at each mesh, and theta_1 = n phi; the inertia
and the back-emf both oppose the motion.
"""

from __future__ import annotations

from ringbalance.controller.compilation.compiled import compiled
from ringbalance.controller.eccentric_mass.plant.parameters import PlantParameters
from ringbalance.scene.arrays import FloatArray


@compiled
def limited(voltage: float, maximum: float) -> float:
    """Cut a voltage to what the supply can give.

    Args: `maximum`: V, positive; may be infinite.
    Returns: V within [-maximum, maximum].
    """
    return min(max(voltage, -maximum), maximum)


@compiled
def electrical_energy(
    parameters: PlantParameters, before: FloatArray, after: FloatArray, command: FloatArray, step: float
) -> float:
    """Energy that both motors take from the supply while their voltages are held.

    E = sum V (V h - K_m n (phi(t + h) - phi(t))) / R_m, the exact integral of V i; negative when a motor
    feeds back.
    Returns: J.
    Source: Kirchhoff's law for the motor without inductance, Eqs. (A1) to (A3) of the paper on eccentric
    masses.
    """
    total = 0.0
    for mass in range(2):
        voltage = limited(command[mass], parameters.maximum_voltage)
        turned = parameters.gear_ratio * (after[4 + mass] - before[4 + mass])
        total += voltage * (voltage * step - parameters.back_emf_constant * turned) / parameters.resistance
    return total
