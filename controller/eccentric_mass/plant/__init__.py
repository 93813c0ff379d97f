"""Rotor, bearing, imbalance, two eccentric masses, their motors and their friction; and its integration in
time.

A new force on rotor or masses goes into `plant`, its constants into `parameters`.
"""
