"""The arithmetic of the law: pieces between knots, and one query of them, the same in every host.

`table` puts knots where a tolerance asks for them, `rows` writes tables as the numbers that `point` reads;
`inverse` adds what an accelerating column needs.
"""
