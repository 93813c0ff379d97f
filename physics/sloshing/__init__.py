"""Small oscillations of the liquid ring: natural frequencies and the response to gravity.

A new force on the free surface or another damping goes into `system`, which builds the matrices; `modes` and
`response` only solve them.  In three dimensions, on a mesh from a file, `body` builds them from the fields of
`projection`, `fast` finds what is faster than twice the speed by its pressure, and `imported` solves them.
"""
