"""Studies that only the report shows: the drag coefficient over bore and viscosity, and what a wrong k costs.

A further study is a module of its own here, with its section in `ringbalance.reports.pages`.
"""
