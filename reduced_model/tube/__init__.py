"""Flow through the tube: heads, path over the siphon crest, and regimes.

A new loss is made in `ringbalance.physics.tube` and comes in through `heads`; a new regime goes into
`regime`.
"""
