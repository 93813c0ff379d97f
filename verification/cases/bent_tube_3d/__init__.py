"""The bent tube in the rotating frame, in three dimensions."""
