"""The whole way from a scene file to a closed loop, at the extremes of every input."""
