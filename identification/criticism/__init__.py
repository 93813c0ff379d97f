"""Whether a fit describes its data: plain arrays (`residual_tests`, `law_comparison`), then a fit (`review`).

Another law of the tube's flow, to be told from the fitted one, goes to `review`.
"""
