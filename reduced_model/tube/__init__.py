"""Flow through the tube: heads, siphon crest, regimes and the operating point.

A new loss is made in `ringbalance.physics.tube` and comes in through `heads`; a new regime goes into
`directed_flow`, a new limit of the liquid column into `crest_margin`.
"""
