"""Law, disc and controller for other programs: at most 4 kB of numbers, and one source.

`compact.py` makes the numbers of the law, whose `pieces.point` answers one query from them, with `chamber.py`
beside it; `disc.py` and `controller.py` go
on in time, `blocks.py` has what a host sees, `translate.py` writes them in other languages; `hosts.py`
and `fmu.py` put frames around them.
"""
