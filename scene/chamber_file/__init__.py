"""One chamber from a mesh file: read, checked with every entity named, and turned into the record of a
disc.

`loading` goes through it all. A format is a reader of its own that gives `contents.Contents`, entered in
`loading`; a name of a boundary stands in `soundness.MEANINGS`, and what can be wrong with cells, as a whole
and each by itself, beside it; with their place about the shaft and the scene's other keys, in `fitting`.
"""
