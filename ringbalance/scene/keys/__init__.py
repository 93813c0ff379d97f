"""Keys of a scene file, and reading of a document by these keys.

A new key is one field of a record in `scene.models`, in `scene.loop_models` or of another balancer:
its annotation declares what it takes (a reader of `fields`), how it may be absent, what it means, how it is
described, and whether it may be uncertain, see `declaration`. A default that follows from other keys names
its rule. `schema` lists the tables of a liquid ring; tools/generate.py docs writes them into docs/scene-
file.md.
"""
