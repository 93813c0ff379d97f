"""Law, disc and controller for other programs: at most 4 kB of numbers, and one source.

`compact.py` makes the numbers of the law, from which `pieces.point` answers one query and `chamber.py` gives
surface and moment; `disc.py` and the steps of the controllers go on in time, `blocks.py` holds the variables
that a host sees, `translate.py` writes functions in other languages; `hosts.py` and `fmu.py` put frames
around them.
"""
