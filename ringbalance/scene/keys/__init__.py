"""Keys of a scene file, and the reading of a document by them.

A new key is one field of a record in `scene.models`, `scene.loop_models` or those beside another balancer:
its annotation declares what it takes (a reader of `fields`), how it may be absent, what it means, how it is
described, and whether it may be uncertain, see `declaration`. A default that follows from other keys names
its rule. `schema` lists the tables of a liquid ring; tools/generate.py docs writes them into docs/scene-
file.md.
"""
