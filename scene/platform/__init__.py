"""What the program needs of the machine: files written whole, worker processes, progress, the terminal.

Another output goes through `files`, another pool of processes through `processes`; nothing here knows a
scene.
"""
