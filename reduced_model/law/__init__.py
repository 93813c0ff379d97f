"""Flow laws: the interface, the calibrated law, the paper's law, their tables and their files.

Another law implements `flow_law.FlowLaw`; laws that may be loaded from a file are listed in `files`.
"""
