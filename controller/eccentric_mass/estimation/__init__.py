"""Estimators of imbalance and friction from measured vibration.

A new state of an estimator goes into `imbalance_model` or `friction_filter`.
"""
