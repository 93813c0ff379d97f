"""The driving gas: valve and line by ISO 6358, its column in a spinning chamber, and what it costs.

A new effect of the gas goes into `supply` where it delays the pressure, into `column` where it changes it.
"""
