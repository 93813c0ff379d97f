"""The decay of disturbances along the turning tube against exact rates."""
