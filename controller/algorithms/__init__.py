"""Control algorithms: pure steps from state and measurement to state and command.

A new algorithm implements `algorithm` in a module of its own and gets its scene name in `by_name`.
"""
