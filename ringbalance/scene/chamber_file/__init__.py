"""One chamber from a mesh file: read, checked with every entity named, and turned into the record of a
disc.

`loading` goes through it all. A format is a reader that gives `body.Contents`, entered in
`mesh_file.READERS`; a name of a boundary stands in `record.MEANINGS`. What can be wrong with cells and names
is in `soundness`; with their place about the shaft and the scene's other keys, in `fitting`.
"""
