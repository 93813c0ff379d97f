"""What a flow law says at single states: operating point, thresholds, pressure profile, residual liquid.

A new pressure that starts or stops a flow into
`point`.
"""
