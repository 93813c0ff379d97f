"""The friction factor's blend of laminar and turbulent flow against published measurements."""
