"""One chamber from a mesh file: read, checked with errors that name the entity, and converted to a record.

`loading` runs all steps. A further format needs a reader that returns `body.Contents`, entered in
`mesh_file.READERS`; a further name of a boundary, an entry in `record.MEANINGS`. `soundness` checks cells and
names; `fitting` checks the position about the shaft and the scene's other keys.
"""
