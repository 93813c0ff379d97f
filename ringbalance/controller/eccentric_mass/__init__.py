"""Two eccentric masses on a rotor: the run, its record, its status and its documents.

SI throughout: angles in rad, imbalances and moments in kg m; masses, angles and complex vectors are those of
the rotor's own frame.  Importing these modules loads the compiler, so that only what runs eccentric masses
should do it.  The mechanics are in `plant`; `step` is one step of the strategy: two
filters, the decisions of `supervisor` and the voltages of `drive_law`, on the records of `memory`.
"""
