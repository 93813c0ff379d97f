"""Off-screen 3-D pictures: shapes, cameras, lettering, and the process that draws them.

A new picture is drawn in `draw`, from fields of `fields`, and requested in `process`.
"""
