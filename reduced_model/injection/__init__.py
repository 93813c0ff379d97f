"""Motion of the liquid of one pair of chambers: an event-driven march, the only code that moves liquid.

`dynamics` holds what moves it (a law's column, gas line, valve, lift to the crest) as a record for compiled
code; `pair` holds a pair's state, the entry from Python, and one injection by the amount to be moved.
Compiled modules: `column` forces, conditions and gas; `lift` the rise to the crest; `step` one step in time,
or a longer one while the liquid rests; `events` what ends a step; `march` the steps through all movements of
the valves.
"""
