"""From a scene to evidence, and from evidence to two HTML files with figures, tables and off-screen pictures.

`evidence` collects the evidence, `saved` stores results for later reports, `sections` lists the sections of
the pages, `page` fills the templates, `report` writes the files.  `figure` is the frame of every figure,
`run_figures` has the figures of a run; `prose` formats words and equations, `traced` numbers.
"""

if not __name__.startswith("ringbalance."):
    raise ImportError(
        f"import ringbalance.{__name__}, not {__name__}: under two names each class exists twice"
    )
