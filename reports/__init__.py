"""From a scene to evidence, and from evidence to two HTML files with figures, tables and off-screen pictures.

`evidence` collects, `saved` keeps, `sections` lists what the pages show, `page` fills the templates,
`report` writes.  `figure` is the frame of every figure, `run_figures` what is drawn of a run; `prose` has
words and equations, `traced` numbers.
"""

if not __name__.startswith("ringbalance."):
    raise ImportError(
        f"import ringbalance.{__name__}, not {__name__}: under two names each class exists twice"
    )
