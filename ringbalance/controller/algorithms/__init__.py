"""Control algorithms: pure steps from state and measurement to state and command.

A new algorithm is a `BuiltIn` with a compiled step, and gets its scene name in `law_based.controller_of`.
"""
