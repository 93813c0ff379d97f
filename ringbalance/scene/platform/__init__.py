"""Services of the machine: files written whole, processes, the terminal, compiled code.

Every output goes through `files`, every pool of processes through `processes`; every compiled function has a
decorator of `compiled`, whose code only `kept_code` reads and writes. Nothing in this package uses a scene.
"""
