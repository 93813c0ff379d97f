"""Services of the machine: files written whole, processes, the terminal, compiled code.

Another output goes through `files`, another pool of processes through `processes`, another compiled function
takes a decorator of `compiled`, whose code `kept_code` alone reads and writes; nothing here knows a scene.
"""
