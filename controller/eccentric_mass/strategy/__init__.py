"""The balancing strategy: targets, stages, gains and motor voltages, as one pure step.

A new stage goes into `supervisor` and `plan`, its settings into `settings`, its state into `records`.
"""
