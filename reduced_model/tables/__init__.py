"""Smooth tables: functions of one variable as pieces of polynomials, evaluated and inverted without a solver.

Another table goes here when a calibration or compiled code reads it: scipy.interpolate alone takes longer to
import than these take to make.
"""
