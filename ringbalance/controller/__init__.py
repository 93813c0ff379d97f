"""The closed loop: rotor, liquid-ring disc, control algorithms and the integration of injections in time."""
