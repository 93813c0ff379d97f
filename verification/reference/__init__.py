"""References that only verification uses: exact, manufactured and published solutions, independent solvers.

An independent solution of a physical term goes here as a module of its own. Nothing outside `verification`
and `reports` imports from here.
"""
