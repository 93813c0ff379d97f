"""References that only verification uses: exact, manufactured and published solutions, independent solvers.

An independent solution of a physical term is a new module here. Nothing outside `verification`
and `reports` imports from here.
"""
