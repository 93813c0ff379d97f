"""Law, disc and controller for other programs: at most 4 kB of numbers, and one source.

`compact.py` makes the numbers of the law, from which `pieces.query` answers one query; `disc.py` and the
steps of the controllers advance in time; `blocks.py` holds the variables for a host; `flatten.py` lowers the
eccentric masses' functions of records to functions of numbers; `translate.py` writes functions of numbers in
other languages; `hosts.py` and `fmu.py` make complete files of them.
"""
