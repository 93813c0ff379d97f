"""Whether a fit describes its data: from plain arrays (`patterns`, `law_comparison`) to a fit (`review`).

Another law of the tube's flow, to be told from the fitted one, goes to `review`.
"""
