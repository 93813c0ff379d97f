"""Figures as SVG, from the evidence alone, all in the style of `style`.

A new figure is a function in the module of its subject; the section that shows it calls it.
"""
