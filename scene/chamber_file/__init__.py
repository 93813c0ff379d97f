"""One chamber's geometry as a mesh file gives it: read, checked by name and shape, in SI.

`record` is what the other rooms see.  What a mesh is integrated or solved for is in `mesh/` and `physics/`.
"""
