"""Flow laws: the interface, the calibrated law, the paper's law, their tables and their files.

Another law implements `flow_law.FlowLaw`; what a user may load from a file is entered in `loading`.
"""
