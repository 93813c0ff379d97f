"""Compiled code: the decorator `compiled`, the files that keep its machine code, and signals meanwhile.

Another compiled function takes the decorator; what is kept on disk is read and written by `cache` alone.
"""
