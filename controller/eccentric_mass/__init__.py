"""Two eccentric masses on a rotor: the run, its record, its status and its documents.

Importing these modules loads the compiler, so that only what runs eccentric masses should do it. The
mechanics are in `plant`, the filters in `estimation`, decisions and drives in `strategy`.
"""
