"""The chamber as closed forms and tables: wall pressure, moment and lambda over the fill, gravity included.

A new effect on the liquid in a chamber goes into `values` as one more model, with its estimated contribution
in `terms`.
"""
