"""Two eccentric masses on a rotor: the run, its record, its status and its documents.

SI throughout: angles in rad, imbalances and moments in kg m; masses, angles and complex vectors are those of
the rotor's own frame.  Importing these modules loads the compiler, so that only what runs eccentric masses
should do it.  The mechanics are in `plant`, the filters in `estimation`, decisions and drives in `strategy`.
"""
