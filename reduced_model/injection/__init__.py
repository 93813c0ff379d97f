"""Liquid of one pair of chambers through time: the event-driven march, the only way that liquid moves.

`dynamics` is what moves it (a law's column, gas line, valve, lift to the crest), as a record for compiled
code; `pair` a pair's state, the way in from Python, and one injection by what it shall move.
Compiled: `column` forces, conditions and gas, `lift` the way up to the crest, `step` one step in time,
or a longer one while the liquid rests, `events` what ends it, `march` all of it through what the
valves do.
"""
